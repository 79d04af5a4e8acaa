"""The rules of FMI 3.0."""
