"""Navigation: where the vehicle is, how it moves, and how sure of it one can be."""
