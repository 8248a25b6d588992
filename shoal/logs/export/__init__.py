"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.camera_calibration import OPTICS, matches_optics
from shoal.logs.export.cdr import ENCAPSULATION, CdrError, cdr_string
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_topics import MessageTopic, MessageTopics
from shoal.logs.export.photo_files import export_suffix, photo_export_bytes
from shoal.logs.export.topic_channels import TopicChannels, ros_name

__all__ = [
    "ENCAPSULATION",
    "OPTICS",
    "CdrError",
    "LogSource",
    "MessageTopic",
    "MessageTopics",
    "TopicChannels",
    "cdr_string",
    "export_suffix",
    "matches_optics",
    "photo_export_bytes",
    "ros_name",
]
