"""Documents of glTF 2.0: their parts, arrays of numbers, and joints at rest."""
