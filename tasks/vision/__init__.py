"""Cameras."""

from tasks.vision.airsim_api.clock import AirSimClock

__all__ = ["AirSimClock"]
