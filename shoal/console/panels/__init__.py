"""Panels that a user describes in a file."""
