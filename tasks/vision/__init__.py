"""Cameras."""

from tasks.vision.airsim_clock import AirSimClock

__all__ = ["AirSimClock"]
