"""Parameters of a vehicle, where they come from, and undo."""
