"""Controllers that follow a path."""
