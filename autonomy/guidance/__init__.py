"""Guidance: tracks, lines and circles, and the course or velocity that leads a vehicle along them."""

from autonomy.guidance.altitude_speed_limits import MultirotorLimits, ground_z
from autonomy.guidance.bottom_guard import BottomGuard
from autonomy.guidance.desired_path import (
    circle_side,
    eta_field,
    is_valid_path,
    length_violation,
    loiters_here,
    path_control_state,
)
from autonomy.guidance.divergence_monitor import AlongTrack, CrossTrack, DivergenceMonitor
from autonomy.guidance.multirotor import NOWHERE, MultirotorGuidance, MultirotorGuidanceGains
from autonomy.guidance.path_following_velocity import Circle, Line, MotionLimits
from autonomy.guidance.pure_pursuit import PurePursuitGains, PurePursuitLaw
from autonomy.guidance.track import PathProgress, Track, progress
from autonomy.guidance.track_guidance import SteeringLaw, TrackGuidance, TrackGuidanceGains
from autonomy.guidance.vector_field import VectorFieldGains, VectorFieldLaw
from autonomy.guidance.yo_yo_motion import UnknownAltitudeError, YoYoMotion, YoYoSettings
from support.planar_geometry import Point, bearing

__all__ = [
    "NOWHERE",
    "AlongTrack",
    "BottomGuard",
    "Circle",
    "CrossTrack",
    "DivergenceMonitor",
    "Line",
    "MotionLimits",
    "MultirotorGuidance",
    "MultirotorGuidanceGains",
    "MultirotorLimits",
    "PathProgress",
    "Point",
    "PurePursuitGains",
    "PurePursuitLaw",
    "SteeringLaw",
    "Track",
    "TrackGuidance",
    "TrackGuidanceGains",
    "UnknownAltitudeError",
    "VectorFieldGains",
    "VectorFieldLaw",
    "YoYoMotion",
    "YoYoSettings",
    "bearing",
    "circle_side",
    "eta_field",
    "ground_z",
    "is_valid_path",
    "length_violation",
    "loiters_here",
    "path_control_state",
    "progress",
]
