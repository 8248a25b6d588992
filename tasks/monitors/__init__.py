"""Tasks that watch the state of the vehicle."""
