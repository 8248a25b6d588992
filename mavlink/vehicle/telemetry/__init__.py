"""The messages that the autopilot streams or sends on request."""

from mavlink.vehicle.telemetry.autopilot import AutopilotTelemetry, StreamService
from mavlink.vehicle.telemetry.named_values import NamedValue, parse_named_value
from mavlink.vehicle.telemetry.sources import TelemetrySources
from mavlink.vehicle.telemetry.streams import STREAMS

__all__ = ["STREAMS", "AutopilotTelemetry", "NamedValue", "StreamService", "TelemetrySources", "parse_named_value"]
