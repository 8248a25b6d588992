"""Monitors: what watches the vehicle and says how it is."""
