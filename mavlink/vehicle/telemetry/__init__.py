"""The messages that the autopilot streams or sends on request."""

from mavlink.vehicle.telemetry.autopilot_telemetry import AutopilotTelemetry, StreamService
from mavlink.vehicle.telemetry.named_value_option import NamedValue, parse_named_value
from mavlink.vehicle.telemetry.streams import STREAMS
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext

__all__ = ["STREAMS", "AutopilotTelemetry", "NamedValue", "StreamService", "TelemetryContext", "parse_named_value"]
