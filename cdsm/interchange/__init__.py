"""Files of other programs: export to MuJoCo, import from CASPR."""
