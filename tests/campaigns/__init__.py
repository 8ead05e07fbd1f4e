"""Long runs by hand, and what makes them; pytest collects short versions of two."""
