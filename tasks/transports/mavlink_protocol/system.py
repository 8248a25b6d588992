"""The vehicle as ground stations see it: its identity, its mode, its latest values."""

import hashlib
import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping

import imc
from imc import coordinates
from mavlink import (
    ARMED,
    CRITICAL,
    CUSTOM_MODE,
    STANDBY,
    STATUS,
    Dialect,
    Fields,
    Flavour,
    Kind,
    Mode,
    from_imc,
    mode_of,
    moving,
)
from runtime.task import Entity, State
from tasks.transports.mavlink_protocol.figures import Figures
from tasks.transports.mavlink_protocol.parameters import ParameterEntry, ParameterTable

COMPONENT = 1
STALE = 3.0
SUBMERGED = 0.3  # m
HOLD_PLAN = "hold"
DEPTH = imc.ZUnits.DEPTH
REMEMBERED = 10
BATTERY = "Batter"
LANDS = "LAND"  # AutopilotMode of an aircraft that lands by itself
OpMode = imc.VehicleState.OpMode
WORKING = (OpMode.SERVICE, OpMode.MANEUVER, OpMode.EXTERNAL)


class MavlinkSystem:
    """The state that all ground stations share.

    `set_parameter(entry, text)`, `stop_plan()` and `hold(station)` send requests to the vehicle; `hold` gets None if
    the position is unknown. `entities` gives the entities whose state counts for arming; `boot` is when the vehicle
    started, in s since 1970. `undulation` is the height of the geoid above the ellipsoid, in m. `rates()` are the rates
    of the messages streamed by default, in Hz.
    """

    def __init__(
        self,
        dialect: Dialect,
        *,
        name: str,
        system: int,
        kind: Kind,
        boot: float,
        undulation: float,
        rates: Callable[[], Mapping[str, float]],
        parameters: ParameterTable,
        entities: Callable[[], Iterable[Entity]],
        set_parameter: Callable[[ParameterEntry, str], None],
        stop_plan: Callable[[], None],
        hold: Callable[[imc.StationKeeping | None], None],
    ):
        self.dialect = dialect
        self.system = system
        self.kind = kind
        self.parameters = parameters
        self.set_parameter = set_parameter
        self.stop_plan = stop_plan
        self._hold = hold
        self.figures = Figures()
        self.rates = rates
        self.home: from_imc.Home | None = None
        self.armed = False
        self.held = False
        self.is_abandoned = False
        self.notices: deque[tuple[int, str]] = deque(maxlen=REMEMBERED)
        self._entities = entities
        self._boot = boot
        self._undulation = undulation
        self._uid = hashlib.sha256(name.encode(errors="surrogateescape")).digest()
        self._builders: dict[str, Callable[[Flavour, float], Fields | None]] = {
            "HEARTBEAT": self._heartbeat,
            "SYS_STATUS": self._sys_status,
            "SYSTEM_TIME": lambda _, now: {
                "time_unix_usec": round(now * 1e6),
                "time_boot_ms": from_imc.boot_ms(now, boot),
            },
            "ATTITUDE": self._attitude,
            "LOCAL_POSITION_NED": self._local_position,
            "GLOBAL_POSITION_INT": self._global_position,
            "GPS_GLOBAL_ORIGIN": lambda _, now: self.home and from_imc.global_origin(self.home, now),
            "VFR_HUD": self._hud,
            "AUTOPILOT_VERSION": lambda flavour, _: self._version(flavour),
            "HOME_POSITION": lambda _, now: self.home and from_imc.home_position(self.home, now),
            "EXTENDED_SYS_STATE": lambda _, now: self._extended_state(),
        }

    def offers(self, name: str) -> bool:
        """Whether a message with this name can be requested."""
        return name in self._builders

    def build(self, name: str, flavour: Flavour, now: float) -> Fields | None:
        """The fields of an offered message; None while the vehicle does not know them."""
        return self._builders[name](flavour, now)

    def hear_state(self, state: imc.EstimatedState, now: float) -> None:
        """Take a new estimate; the first valid one gives home, but latitude and longitude 0 until there is another."""
        self.figures.take("state", state, now)
        if self.home is None or self.home.lat == self.home.lon == 0.0:
            home = from_imc.home_of(state, afloat=self.kind.afloat, undulation=self._undulation)
            self.home = home or self.home

    def hear_mode(self, state: imc.VehicleState | imc.PlanControlState, now: float) -> None:
        """Take what the supervisors publish about the vehicle's activity; a new activity ends a requested hold."""
        if isinstance(state, imc.PlanControlState):
            self.figures.take("plan", state, now)
        else:
            self.figures.take("vehicle", state, now)
            self.held = self.held and not moving(state)
            self.is_abandoned = False

    def hear_figure(self, message: imc.Message, label: str, now: float) -> None:
        """Take a measurement of an entity; if several measure voltage or current, the batteries count."""
        figures = self.figures
        match message:
            case imc.Voltage(value=value) if self._powers(label):
                figures.take("voltage", value, now)
            case imc.Current(value=value) if self._powers(label):
                figures.take("current", value, now)
            case imc.FuelLevel(value=value):
                figures.take("fuel", value, now)
            case imc.CpuUsage(value=value):
                figures.take("load", value, now)
            case imc.IndicatedSpeed(value=value):
                figures.take("airspeed", value, now)
            case imc.Throttle(value=value):
                figures.take("throttle", value, now)
            case imc.VehicleMedium(medium=medium):
                figures.take("medium", medium, now)
            case imc.AutopilotMode(mode=mode):
                figures.take("autopilot", mode, now)
            case imc.ArmingState(state=state):
                self.armed = self.armed and not (figures.motors and state != imc.ArmingState.State.ARMED)
                figures.take("motors", state == imc.ArmingState.State.ARMED, now)
            case _:
                pass

    def forget_old(self, now: float) -> None:
        """Forget what nobody reports any more; a vehicle whose supervisor is silent is in a critical state."""
        self.is_abandoned |= "vehicle" in self.figures.forget_old(now)

    def hold(self, now: float) -> None:
        """Hold: keep station here if it moves, is armed or is under water; otherwise only show the mode."""
        vehicle = self.figures.vehicle
        able = vehicle is not None and vehicle.op_mode in WORKING
        holds = self.mode is Mode.HOLD and moving(vehicle)
        if able and not holds and (self.armed_or_moving or self._is_submerged(now)):
            self._hold(self._station(now))
        self.held = True

    def _is_submerged(self, now: float) -> bool:
        state = self._present(now)
        return self.kind.afloat and state is not None and state.depth > SUBMERGED

    def _station(self, now: float) -> imc.StationKeeping | None:
        """Here, at the present depth or height."""
        found = self.place(now)
        if found is None:
            return None
        place = found[1]
        if self.kind.afloat:
            return imc.StationKeeping(lat=place.lat, lon=place.lon, z=max(0.0, -place.relative), z_units=DEPTH)
        height = place.altitude + self._undulation
        return imc.StationKeeping(lat=place.lat, lon=place.lon, z=height, z_units=imc.ZUnits.HEIGHT)

    def _powers(self, label: str) -> bool:
        return BATTERY in label or not any(BATTERY in entity.label for entity in self._entities())

    @property
    def shown(self) -> tuple[Mode, bool]:
        """What ground stations must learn immediately."""
        return self.mode, self.armed_or_moving

    @property
    def mode(self) -> Mode:
        """What the vehicle does; HOLD also if a ground station asked for it and nothing else goes on."""
        if self.aloft and self.figures.autopilot == LANDS:
            return Mode.LAND
        if self.holds_station:
            return Mode.HOLD
        mode = mode_of(self.figures.vehicle, self.figures.plan, aloft=self.aloft)
        return Mode.HOLD if mode is Mode.MANUAL and self.held else mode

    @property
    def holds_station(self) -> bool:
        """Whether it holds because a ground station asked for it."""
        plan = self.figures.plan
        return plan is not None and plan.plan_id == HOLD_PLAN and moving(self.figures.vehicle)

    @property
    def armed_or_moving(self) -> bool:
        """Whether it is armed over MAVLink, moving for any other reason, or has running motors."""
        return self.armed or moving(self.figures.vehicle) or bool(self.figures.motors)

    @property
    def aloft(self) -> bool:
        """Whether it is an aircraft in the air, that is, with running motors."""
        return not self.kind.afloat and bool(self.figures.motors)

    @property
    def obstacle(self) -> str:
        """Why the vehicle cannot be armed; empty if it can."""
        vehicle = self.figures.vehicle
        if self.is_abandoned:
            return "VehicleState is missing"
        if vehicle is not None and vehicle.op_mode not in WORKING:
            mode = next((mode.name for mode in OpMode if mode == vehicle.op_mode), f"mode {vehicle.op_mode}")
            return f"the vehicle is in {mode}" + (f": {vehicle.error_ents}" if vehicle.error_ents else "")
        ill = next((e for e in self._entities() if e.stateful and e.state != State.NORMAL), None)
        return f"{ill.label} is in {ill.state.name}: {ill.description}" if ill else ""

    def place(self, now: float) -> tuple[imc.EstimatedState, from_imc.Position] | None:
        """The present estimate and its position; None if it is missing, old or impossible."""
        state = self._present(now)
        if state is None or self.home is None:
            return None
        place = from_imc.place_of(state, self.home, afloat=self.kind.afloat, undulation=self._undulation)
        return (state, place) if place is not None else None

    def describe(self, north: float, east: float, now: float) -> str:
        """Latitude and longitude (degrees) of a point at an offset (m) from the vehicle; the offset if unknown."""
        found = self.place(now)
        if found is None or not (math.isfinite(north) and math.isfinite(east)):
            return f"{north:.1f} m north, {east:.1f} m east"
        lat, lon, _ = coordinates.displace(found[1].lat, found[1].lon, 0.0, north, east, 0.0)
        return f"{math.degrees(lat):.6f},{math.degrees(lon):.6f}"

    def remember(self, severity: int, words: str) -> None:
        """Keep a notice for ground stations that connect later."""
        self.notices.append((severity, words))

    def _present(self, now: float) -> imc.EstimatedState | None:
        return self.figures.state if now - self.figures.heard.get("state", -STALE) <= STALE else None

    def _time(self, state: imc.EstimatedState) -> int:
        return from_imc.boot_ms(state.timestamp, self._boot)

    def _heartbeat(self, flavour: Flavour, now: float) -> Fields:
        vehicle, mode = self.figures.vehicle, self.mode
        status = STANDBY if vehicle is None else STATUS.get(vehicle.op_mode, STANDBY)
        if self.is_abandoned or any(e.stateful and e.state in (State.ERROR, State.FAILURE) for e in self._entities()):
            status = CRITICAL
        return {
            "type": self.kind.type,
            "autopilot": flavour.autopilot,
            "base_mode": CUSTOM_MODE | mode.flags | (ARMED if self.armed_or_moving else 0),
            "custom_mode": flavour.custom_mode(self.kind, mode),
            "system_status": status,
            "mavlink_version": 3,
        }

    def _extended_state(self) -> Fields:
        figures = self.figures
        if self.kind.afloat or figures.motors is None:
            return from_imc.extended_state(figures.medium, self.armed_or_moving)
        kind = figures.vehicle.maneuver_type if figures.vehicle is not None else None
        rises, lands = kind == imc.Takeoff.ID, kind == imc.Land.ID or figures.autopilot == LANDS
        return from_imc.flying_state(figures.motors, rises=rises, lands=lands)

    def _sys_status(self, _: Flavour, now: float) -> Fields:
        states = [(entity.label, entity.state) for entity in self._entities() if entity.stateful]
        bits = from_imc.sensors(states, located=self.place(now) is not None, ready=not self.obstacle)
        figures = self.figures
        return from_imc.system_status(bits, figures.load, figures.voltage, figures.current, figures.fuel)

    def _attitude(self, _: Flavour, now: float) -> Fields | None:
        state = self._present(now)
        return from_imc.attitude(state, self._time(state)) if state is not None else None

    def _global_position(self, _: Flavour, now: float) -> Fields | None:
        found = self.place(now)
        return from_imc.global_position(*found, self._time(found[0])) if found else None

    def _local_position(self, _: Flavour, now: float) -> Fields | None:
        found = self.place(now)
        return from_imc.local_position(*found, self.home, self._time(found[0])) if found and self.home else None

    def _hud(self, _: Flavour, now: float) -> Fields | None:
        found = self.place(now)
        return from_imc.hud(*found, self.figures.airspeed, self.figures.throttle) if found else None

    def _version(self, flavour: Flavour) -> Fields:
        return {
            "capabilities": flavour.capabilities,
            "flight_sw_version": flavour.software_version,
            "uid": int.from_bytes(self._uid[:8], "little"),
            "uid2": tuple(self._uid[:18]),
        }
