"""Plans: their database, the engine that executes them, and the checks before a start."""
