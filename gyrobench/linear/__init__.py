"""Linear models of parts and of systems."""
