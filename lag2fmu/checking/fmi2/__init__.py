"""The rules of FMI 2.0."""
