"""Controllers of an autonomous underwater vehicle."""
