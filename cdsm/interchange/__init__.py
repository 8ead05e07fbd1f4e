"""Files of other programs: cable files, MuJoCo, CASPR."""
