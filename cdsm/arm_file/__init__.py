"""Arms as TOML files: robot, cables, wires, gravity, tolerances."""
