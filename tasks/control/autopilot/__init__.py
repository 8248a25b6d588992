"""Autopilots that are the body of a vehicle: they estimate its position, and steer it."""
