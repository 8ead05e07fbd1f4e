"""Exchange arms with other programs: export to MuJoCo, import from CASPR."""
