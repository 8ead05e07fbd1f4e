"""An arm as one TOML file: its robot, its cables and their wires, gravity."""
