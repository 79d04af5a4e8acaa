"""Systems of FMUs: what they show to each other, what is connected, and the archive that says so."""
