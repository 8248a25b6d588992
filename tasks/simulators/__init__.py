"""Simulated vehicle and sensors."""
