"""The messages that the vehicle streams or sends on request: one entry each."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from mavlink import Fields, Flavor
from mavlink.vehicle.telemetry import motion_messages as motion
from mavlink.vehicle.telemetry import sensor_messages as sensors
from mavlink.vehicle.telemetry import status_messages as status
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext

RAW, STATUS, POSITION, EXTRA_1, EXTRA_2, EXTRA_3 = 1, 2, 6, 10, 11, 12  # MAV_DATA_STREAM

Built = Fields | Sequence[Fields] | None


class MessageStream(NamedTuple):
    """A message: `rate` is its default in Hz, 0 for one that is only sent on request, or the option of the task that
    gives it; `low` the default on slow links. `group` is that of the older REQUEST_DATA_STREAM. `sources` is what it
    is made of. `build` gives the fields of each instance, and none while they are unknown; the second parameter of
    REQUEST_MESSAGE chooses the instance by the field `numbered`.
    """

    name: str
    rate: float | str
    group: int
    sources: str
    build: Callable[[TelemetryContext, Flavor, float], Built]
    low: float = 0.0
    numbered: str = ""

    def build_message_fields(
        self, sources: TelemetryContext, flavor: Flavor, now: float, number: int = 0
    ) -> Sequence[Fields]:
        """The fields of all messages that can be sent now, or of the one with a number (from 1)."""
        built = self.build(sources, flavor, now)
        found = () if built is None else (built,) if isinstance(built, Mapping) else built
        if self.numbered and number > 0:
            return [fields for fields in found if fields[self.numbered] == number]
        return found


STREAMS: Mapping[str, MessageStream] = {
    stream.name: stream
    for stream in (
        MessageStream(
            "HEARTBEAT",
            1.0,
            0,
            "VehicleState, PlanControlState, states of the entities",
            status.heartbeat,
            low=1.0,
        ),
        MessageStream(
            "SYS_STATUS",
            "status_rate",
            STATUS,
            "states of the entities, Voltage, Current, FuelLevel, CpuUsage",
            status.sys_status,
            low=0.2,
        ),
        MessageStream("SYSTEM_TIME", 1.0, STATUS, "the clock", status.system_time),
        MessageStream("GPS_RAW_INT", 2.0, STATUS, "GpsFix", motion.gps_raw),
        MessageStream("ATTITUDE", "attitude_rate", EXTRA_1, "EstimatedState", motion.attitude),
        MessageStream("ATTITUDE_QUATERNION", 2.0, EXTRA_1, "EstimatedState", motion.attitude_quaternion),
        MessageStream("ODOMETRY", 0.5, EXTRA_1, "EstimatedState, NavigationUncertainty", motion.odometry),
        MessageStream("LOCAL_POSITION_NED", "position_rate", POSITION, "EstimatedState", motion.local_position),
        MessageStream(
            "GLOBAL_POSITION_INT", "position_rate", POSITION, "EstimatedState", motion.global_position, low=1.0
        ),
        MessageStream("MISSION_CURRENT", 1.0, STATUS, "the mission, PlanControlState", status.mission_current, low=0.2),
        MessageStream(
            "NAV_CONTROLLER_OUTPUT",
            1.0,
            STATUS,
            "PathControlState, if a path is followed; EstimatedState",
            motion.nav_controller_output,
        ),
        MessageStream(
            "VFR_HUD",
            "position_rate",
            EXTRA_2,
            "EstimatedState, IndicatedSpeed, Throttle or SetThrusterActuation",
            motion.vfr_hud,
        ),
        MessageStream("ALTITUDE", 1.0, EXTRA_3, "EstimatedState", motion.altitude),
        MessageStream(
            "BATTERY_STATUS",
            0.5,
            EXTRA_3,
            "Voltage, Current, FuelLevel, Temperature of each battery",
            sensors.batteries,
        ),
        MessageStream("HOME_POSITION", 1.0, EXTRA_3, "the first EstimatedState", motion.home_position),
        MessageStream("GPS_GLOBAL_ORIGIN", 0.0, 0, "the first EstimatedState", motion.global_origin),
        MessageStream(
            "EXTENDED_SYS_STATE", 1.0, EXTRA_3, "VehicleMedium; ArmingState of aircraft", status.extended_state
        ),
        MessageStream(
            "SCALED_PRESSURE", 1.0, RAW, "Pressure, Temperature of a barometer or hull", sensors.air_pressure
        ),
        MessageStream(
            "SCALED_PRESSURE2", 1.0, RAW, "Pressure, Temperature of the depth sensor", sensors.water_pressure
        ),
        MessageStream(
            "DISTANCE_SENSOR",
            2.0,
            EXTRA_3,
            "EstimatedState, Distance of the echo sounder",
            sensors.distance_sensors,
        ),
        MessageStream("RAW_IMU", 0.0, RAW, "Acceleration, AngularVelocity, MagneticField", sensors.raw_imu),
        MessageStream("HIGHRES_IMU", 1.0, 0, "Acceleration, AngularVelocity, MagneticField", sensors.highres_imu),
        MessageStream("CURRENT_MODE", 0.5, 0, "VehicleState, PlanControlState", status.current_mode),
        MessageStream("ESTIMATOR_STATUS", 0.5, 0, "NavigationUncertainty", motion.estimator_status),
        MessageStream("WATER_DEPTH", 0.5, 0, "EstimatedState of vessels", motion.water_depth),
        MessageStream("NAMED_VALUE_FLOAT", 1.0, EXTRA_3, "`Named Values`", status.named_values),
        MessageStream(
            "HIGH_LATENCY2",
            0.0,
            0,
            "EstimatedState, FuelLevel, states of the entities",
            status.high_latency,
            low=0.2,
        ),
        MessageStream("AVAILABLE_MODES", 0.0, 0, "`Vehicle Kind`", status.available_modes, numbered="mode_index"),
        MessageStream("AVAILABLE_MODES_MONITOR", 0.3, 0, "`Vehicle Kind`", status.modes_monitor),
        MessageStream(
            "AUTOPILOT_VERSION", 0.0, 0, "Shoal's version, the name of the vehicle", status.autopilot_version
        ),
        MessageStream("COMPONENT_METADATA", 0.0, 0, "the parameters of all tasks", status.component_metadata),
        MessageStream("PROTOCOL_VERSION", 0.0, 0, "MAVLink 2", status.protocol_version),
    )
}
"""The streams by name."""
