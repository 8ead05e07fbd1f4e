"""Tools that every chapter uses: validation, frozen values, files, XML, units."""
