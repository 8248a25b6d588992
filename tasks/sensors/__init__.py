"""Drivers of sensors: GPS receivers, sound velocity."""
