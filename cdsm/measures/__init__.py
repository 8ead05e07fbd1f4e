"""What an arm can carry and where its cables run: measures of one posture, from its arrays."""
