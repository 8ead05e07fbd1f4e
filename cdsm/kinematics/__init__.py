"""Joint angles from tip poses and from cable lengths."""
