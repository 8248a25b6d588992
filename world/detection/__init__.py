"""Finds things in pictures, and where they are."""

from world.detection.blob_detector import YELLOW, BlobDetector, ImageDetection
from world.detection.detection_probability import DetectionProbability
from world.detection.ground_projection import (
    DetectionAccuracy,
    Floats,
    PlaneDetection,
    PoseOverPlane,
    fits_size,
    point_on_plane,
    project_to_plane,
)
from world.detection.marker_detector import MARKER_FAMILIES, MarkerDetector
from world.detection.scoring import DetectionStatistics, ObjectScore, detection_statistics, match_objects
from world.detection.tracker import ObjectTrack, Tracker, TrackerSettings, TrackMeasurement

__all__ = [
    "MARKER_FAMILIES",
    "YELLOW",
    "BlobDetector",
    "DetectionAccuracy",
    "DetectionProbability",
    "DetectionStatistics",
    "Floats",
    "ImageDetection",
    "MarkerDetector",
    "ObjectScore",
    "ObjectTrack",
    "PlaneDetection",
    "PoseOverPlane",
    "TrackMeasurement",
    "Tracker",
    "TrackerSettings",
    "detection_statistics",
    "fits_size",
    "match_objects",
    "point_on_plane",
    "project_to_plane",
]
