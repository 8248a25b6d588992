"""Plans: their database, the engine that executes them, and the generator of plans from templates."""
