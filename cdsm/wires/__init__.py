"""Laws EA(F) of wires, files of these laws, and fits of tensile tests."""
