"""Supervision: the mode of the vehicle."""
