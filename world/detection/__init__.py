"""Finds things in pictures, and where they are."""

from world.detection.blob_detector import YELLOW, BlobDetector, Mark
from world.detection.detection_probability import Chances
from world.detection.ground_projection import Accuracy, Floats, Sighting, Standing, fits, sight, spot_at
from world.detection.marker_detector import FAMILIES, MarkerDetector
from world.detection.scoring import Score, ThingScore, matched, score
from world.detection.tracker import Habits, Track, Tracker, View

__all__ = [
    "FAMILIES",
    "YELLOW",
    "Accuracy",
    "BlobDetector",
    "Chances",
    "Floats",
    "Habits",
    "Mark",
    "MarkerDetector",
    "Score",
    "Sighting",
    "Standing",
    "ThingScore",
    "Track",
    "Tracker",
    "View",
    "fits",
    "matched",
    "score",
    "sight",
    "spot_at",
]
