"""Navigation of an autonomous underwater vehicle."""
