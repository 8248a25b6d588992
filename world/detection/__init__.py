"""Finds things in pictures, and where they are."""

from world.detection.blobs import YELLOW, BlobDetector, Mark
from world.detection.chances import Chances
from world.detection.ground import Accuracy, Floats, Sighting, Standing, fits, sight, spot_at
from world.detection.judgement import Score, ThingScore, matched, score
from world.detection.markers import FAMILIES, MarkerDetector
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
