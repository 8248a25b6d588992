"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.camera_calibration import (
    OPTICS,
    LoggedCamera,
    load_camera_models,
    matches_optics,
    read_photo_cameras,
)
from shoal.logs.export.cdr import ENCAPSULATION, CdrError, cdr_string
from shoal.logs.export.foxglove_annotations import ANNOTATIONS, image_annotations
from shoal.logs.export.logged_detections import FIELDS as DETECTION_FIELDS
from shoal.logs.export.logged_detections import SystemDetections
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_topics import MessageTopic, MessageTopics
from shoal.logs.export.photo_files import Photo, export_suffix, find_photos, photo_export_bytes
from shoal.logs.export.ros_camera_info import CAMERA_INFO, camera_info, encode_camera_transform
from shoal.logs.export.ros_standard_conversion import TRANSFORM, MapOrigin, first_origin
from shoal.logs.export.topic_channels import TopicChannels, ros_name

__all__ = [
    "ANNOTATIONS",
    "CAMERA_INFO",
    "DETECTION_FIELDS",
    "ENCAPSULATION",
    "OPTICS",
    "TRANSFORM",
    "CdrError",
    "LogSource",
    "LoggedCamera",
    "MapOrigin",
    "MessageTopic",
    "MessageTopics",
    "Photo",
    "SystemDetections",
    "TopicChannels",
    "camera_info",
    "cdr_string",
    "encode_camera_transform",
    "export_suffix",
    "find_photos",
    "first_origin",
    "image_annotations",
    "load_camera_models",
    "matches_optics",
    "photo_export_bytes",
    "read_photo_cameras",
    "ros_name",
]
