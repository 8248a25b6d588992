"""Keeps the operational limits of the vehicle and reports violations."""

import math

import imc
from imc.coordinates import absolute_position, area_contains
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime import ParameterError, State, Task, consume, param, periodic

Limit = imc.OpLimitsMask
MAX_DEPTH, MIN_ALT, MAX_ALT = Limit.MAX_DEPTH.value, Limit.MIN_ALT.value, Limit.MAX_ALT.value
MIN_SPEED, MAX_SPEED, MAX_VRATE = Limit.MIN_SPEED.value, Limit.MAX_SPEED.value, Limit.MAX_VRATE.value
AREA = Limit.AREA.value
UNSET = -1.0


class OperationalLimits(Task):
    """Publishes OperationalLimits, accepts new ones, and is in ERROR while the vehicle violates one.

    -1 means no limit. Depth and altitude have a hysteresis, so that a violation does not flicker.
    """

    execution_frequency: float = param(4.0, "Hz", "Rate of the checks.", minimum=0.001, maximum=1000)
    maximum_depth: float = param(UNSET, "m", "Maximum depth at the start.", name="Initial Setting - Maximum Depth")
    minimum_altitude: float = param(
        UNSET, "m", "Minimum altitude at the start.", name="Initial Setting - Minimum Altitude"
    )
    maximum_altitude: float = param(
        UNSET, "m", "Maximum altitude at the start.", name="Initial Setting - Maximum Altitude"
    )
    minimum_speed: float = param(UNSET, "m/s", "Minimum speed at the start.", name="Initial Setting - Minimum Speed")
    maximum_speed: float = param(UNSET, "m/s", "Maximum speed at the start.", name="Initial Setting - Maximum Speed")
    maximum_vertical_rate: float = param(
        UNSET, "m/s", "Maximum vertical rate at the start.", name="Initial Setting - Maximum Vertical Rate"
    )
    area_center: list[float] = param(
        [],
        "°",
        "Latitude and longitude of the area's center; empty means no area.",
        name="Initial Setting - Area Center",
        size=(0, 2),
    )
    area_size: list[float] = param(
        [1000.0, 1000.0], "m", "Length and width of the area.", name="Initial Setting - Area Size", size=2
    )
    area_orientation: float = param(
        0.0, "°", "Direction of the area's length.", name="Initial Setting - Area Orientation"
    )
    depth_hysteresis: float = param(
        0.3,
        "m",
        "A depth violation ends this far above the limit.",
        name="Hysteresis Threshold - Maximum Depth",
    )
    altitude_hysteresis: float = param(
        0.3,
        "m",
        "An altitude violation ends this far above the limit.",
        name="Hysteresis Threshold - Minimum Altitude",
    )
    minimum_depth_to_check_altitude: float = param(
        0.3, "m", "Altitude is checked below this depth.", name="Minimum Depth to Check Altitude", minimum=0
    )

    def configure(self) -> None:
        center = self.area_center
        if len(center) == 1 or (center and not (abs(center[0]) <= 90.0 and abs(center[1]) <= 180.0)):
            raise ParameterError("Initial Setting - Area Center", f"{center} is not a latitude and a longitude")

    def start(self) -> None:
        initial = imc.OperationalLimits(
            max_depth=max(0.0, self.maximum_depth),
            min_altitude=max(0.0, self.minimum_altitude),
            max_altitude=max(0.0, self.maximum_altitude),
            min_speed=max(0.0, self.minimum_speed),
            max_speed=max(0.0, self.maximum_speed),
            max_vrate=max(0.0, self.maximum_vertical_rate),
        )
        if self.area_center:
            lat, lon = map(math.radians, self.area_center)
            length, width = self.area_size
            orientation = math.radians(self.area_orientation)
            initial = initial.replace(lat=lat, lon=lon, length=length, width=width, orientation=orientation)
        values = {
            MAX_DEPTH: self.maximum_depth,
            MIN_ALT: self.minimum_altitude,
            MAX_ALT: self.maximum_altitude,
            MIN_SPEED: self.minimum_speed,
            MAX_SPEED: self.maximum_speed,
            MAX_VRATE: self.maximum_vertical_rate,
        }
        mask = sum(limit for limit, value in values.items() if value >= 0.0)  # integers
        self._limits = initial.replace(mask=mask | (AREA if self.area_center else 0))
        self._state: imc.EstimatedState | None = None
        self._passed: set[str] = set()
        self.publish(self._limits)
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self._state = state

    @consume(others=True)
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        """Take and publish new limits; reject them if a value is not finite."""
        if not self.is_for_me(limits):
            return
        numbers = [value for value in limits.to_dict().values() if isinstance(value, float)]
        if not all(map(math.isfinite, numbers)):
            self.log.error(f"limits from {self.vehicle.systems.name(limits.src)} have a value that is not a number")
            return
        self._limits = limits.replace(
            timestamp=-1.0, src=self.system, src_ent=self.entity.id, dst=UNKNOWN_SYSTEM, dst_ent=UNKNOWN_ENTITY
        )
        self.publish(self._limits)

    @consume(others=True)
    def on_get_operational_limits(self, request: imc.GetOperationalLimits) -> None:
        if request.dst in (self.system, UNKNOWN_SYSTEM):
            self.reply(request, self._limits)

    @periodic("execution_frequency")
    def check(self) -> None:
        if self._state is None:
            return
        self._passed = self._violations(self._state)
        if self._passed:
            self.set_entity_state(State.ERROR, f"violates {', '.join(sorted(self._passed))}")
        else:
            self.set_entity_state(State.NORMAL, "active")

    def _violations(self, state: imc.EstimatedState) -> set[str]:
        limits, mask = self._limits, self._limits.mask
        speed, sinking = math.hypot(state.vx, state.vy, state.vz), abs(state.vz)
        depth_back = self.depth_hysteresis if "maximum depth" in self._passed else 0.0
        altitude_back = self.altitude_hysteresis if "minimum altitude" in self._passed else 0.0
        deep = state.alt >= 0.0 and state.depth > self.minimum_depth_to_check_altitude
        high = deep or state.depth <= UNSET  # aircraft have no depth; they start and land on the ground
        found = {
            "maximum depth": mask & MAX_DEPTH and state.depth > limits.max_depth - depth_back,
            "minimum altitude": mask & MIN_ALT and deep and state.alt < limits.min_altitude + altitude_back,
            "maximum altitude": mask & MAX_ALT and high and state.alt > limits.max_altitude,
            "minimum speed": mask & MIN_SPEED and speed < limits.min_speed,
            "maximum speed": mask & MAX_SPEED and speed > limits.max_speed,
            "maximum vertical rate": mask & MAX_VRATE and sinking > limits.max_vrate,
            "area": mask & AREA and not area_contains(limits, *absolute_position(state)[:2]),
        }
        return {name for name, passed in found.items() if passed}
