"""Vehicles live in Foxglove and Lichtblick, over their WebSocket protocol."""

from shoal.console.foxglove.playback import Playback
from shoal.console.foxglove.routes import FoxgloveRoutes
from shoal.console.foxglove.viewer_access import ViewerAccess

__all__ = ["FoxgloveRoutes", "Playback", "ViewerAccess"]
