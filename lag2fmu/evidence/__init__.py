"""Evidence on exported FMUs for others: records by the habits of the FMI project."""
