"""Long runs by hand, which pytest does not collect."""
