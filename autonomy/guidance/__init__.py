"""Guidance: tracks, lines and circles, and the course or velocity that leads a vehicle along them."""

from autonomy.guidance.bottom_guard import BottomGuard
from autonomy.guidance.divergence import AlongTrack, CrossTrack, DivergenceMonitor
from autonomy.guidance.legs import Circle, Line, MotionLimits
from autonomy.guidance.multirotor_limits import MultirotorLimits, ground_level
from autonomy.guidance.track import PathProgress, Point, Track, bearing, is_valid_path, progress

__all__ = [
    "AlongTrack",
    "BottomGuard",
    "Circle",
    "CrossTrack",
    "DivergenceMonitor",
    "Line",
    "MotionLimits",
    "MultirotorLimits",
    "PathProgress",
    "Point",
    "Track",
    "bearing",
    "ground_level",
    "is_valid_path",
    "progress",
]
