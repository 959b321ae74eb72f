"""Files: written so that no reader meets half of one, rows with their provenance, TOML that refuses unknown keys."""
