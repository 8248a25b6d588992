"""The vehicle's side of MAVLink without I/O: what ground stations see, and what they ask for."""

from mavlink.vehicle.endpoint import CHANGES, UNLISTED, VehicleEndpoint, VehicleEquipment
from mavlink.vehicle.interfaces import (
    CameraView,
    EntityView,
    FileEntry,
    FileStore,
    OpenFile,
    ParameterDeclaration,
    ParameterView,
    PictureStore,
    Thumbnail,
    VehicleOptions,
    VehiclePort,
)
from mavlink.vehicle.latest_values import ShownMessages
from mavlink.vehicle.model import GUIDED_PLANS, VehicleIdentity, VehicleModel
from mavlink.vehicle.session import (
    DATAGRAM_BURST,
    DATAGRAMS_PER_SECOND,
    SOON,
    LinkTraits,
    MessageSource,
    Session,
    is_addressed,
)

__all__ = [
    "CHANGES",
    "DATAGRAMS_PER_SECOND",
    "DATAGRAM_BURST",
    "GUIDED_PLANS",
    "SOON",
    "UNLISTED",
    "CameraView",
    "EntityView",
    "FileEntry",
    "FileStore",
    "LinkTraits",
    "MessageSource",
    "OpenFile",
    "ParameterDeclaration",
    "ParameterView",
    "PictureStore",
    "Session",
    "ShownMessages",
    "Thumbnail",
    "VehicleEndpoint",
    "VehicleEquipment",
    "VehicleIdentity",
    "VehicleModel",
    "VehicleOptions",
    "VehiclePort",
    "is_addressed",
]
