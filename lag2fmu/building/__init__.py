"""Compilers run and what they made kept: what the FMU's libraries and the direct integration share."""
