"""Tasks that supervise the mode of the vehicle."""
