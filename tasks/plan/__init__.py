"""Plans: their database, the engine that executes them, and what is known of them before."""
