"""The cameras of a vehicle as components of their own: pictures, detections, settings."""

from mavlink.vehicle.camera.broadcast import CameraBroadcast
from mavlink.vehicle.camera.camera_telemetry import CameraTelemetry
from mavlink.vehicle.camera.component import CameraComponent, is_camera, parse_video, takes_pictures
from mavlink.vehicle.camera.image_transmission import ImageTransmission
from mavlink.vehicle.camera.service import CameraService, addressed_sessions

__all__ = [
    "CameraBroadcast",
    "CameraComponent",
    "CameraService",
    "CameraTelemetry",
    "ImageTransmission",
    "addressed_sessions",
    "is_camera",
    "parse_video",
    "takes_pictures",
]
