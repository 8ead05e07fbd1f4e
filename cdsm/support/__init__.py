"""What every chapter uses: validation, frozen values, files, XML, units."""
