"""Maneuvers that follow references from another system, one per kind of vehicle."""
