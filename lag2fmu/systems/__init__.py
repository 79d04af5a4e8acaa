"""Systems of FMUs: their components with connectors, the connections, and the archive that describes both."""
