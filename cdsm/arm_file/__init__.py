"""Read and write arms as TOML files: robot, cables, wires, gravity, tolerances."""
