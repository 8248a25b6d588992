"""Autopilots that are the body of a vehicle: they know where it is, and carry out where it goes."""
