"""Files: written whole or not at all, rows with their provenance, and TOML whose unknown keys are refused."""
