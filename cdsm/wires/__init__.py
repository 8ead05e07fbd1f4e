"""Laws of the rigidity of a wire over its tension, files of these laws, and tensile tests."""
