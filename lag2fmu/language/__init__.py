"""Units, dimensions, expressions and their parser; this room knows no mechanism."""
