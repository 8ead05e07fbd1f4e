"""Cable files, and files of other programs: MuJoCo and CASPR."""
