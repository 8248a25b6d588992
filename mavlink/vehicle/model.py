"""The vehicle as ground stations see it: its identity, latest values, mode, home, arming, health and limits."""

import hashlib
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import imc
from autonomy.plans import is_airborne
from mavlink import Flavor, Mode, VehicleKind, is_maneuvering, mode_of, positions
from mavlink.missions import ConversionContext
from mavlink.translate import from_imc, sensors_from_imc
from mavlink.vehicle.arming_checks import ArmingChecks
from mavlink.vehicle.interfaces import EntityView, VehicleOptions, VehiclePort
from mavlink.vehicle.latest_values import LatestValues
from mavlink.vehicle.vehicle_limits import VehicleLimits

AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1
SUBMERGED = 0.3  # m
SHALLOW = 0.5  # m at which an AUV keeps station adrift
SUBMARINE = 12  # MAV_TYPE
DEPTH = imc.ZUnits.DEPTH
REMEMBERED = 10
SAVE_IMAGES = "Save Images"  # the option by which a camera takes pictures
GUIDED_PLANS = frozenset(("hold", "goto", "return", "land", "takeoff", "orbit", "steered", "follow"))
"""Plans that single orders of ground stations become; they are no missions."""
ARRIVING_PLANS = frozenset(("goto", "takeoff"))
"""Guided plans that end at a place, where the vehicle holds."""


@dataclass(frozen=True, slots=True)
class VehicleIdentity:
    """Identity of a vehicle in MAVLink.

    boot: when it started, in s since 1970. undulation: the height of the geoid above the ellipsoid, in m.
    """

    name: str
    system: int
    kind: VehicleKind
    boot: float
    undulation: float = 0.0

    @property
    def uid(self) -> bytes:
        return hashlib.sha256(self.name.encode(errors="surrogateescape")).digest()


class VehicleModel:
    """The state that all ground stations share, as far as messages of the vehicle contain it.

    `entities()` gives those whose state counts for arming. `camera` is the label of the one with which missions take
    pictures, empty for none.
    """

    camera = ""

    def __init__(
        self,
        identity: VehicleIdentity,
        port: VehiclePort,
        options: VehicleOptions,
        entities: Callable[[], Iterable[EntityView]],
    ):
        self.identity = identity
        self.system: int = identity.system
        self.kind: VehicleKind = identity.kind
        self.boot: float = identity.boot
        self.undulation: float = identity.undulation
        self.options = options
        self.entities = entities
        self._port = port
        self.latest: LatestValues = LatestValues(lambda: [entity.label for entity in self.entities()], self.age)
        self.limits: VehicleLimits = VehicleLimits(self.latest, port.profile_limit)
        self.health: ArmingChecks = ArmingChecks(entities)
        self.home: positions.Home | None = None
        self.last_fix: imc.GpsFix | None = None
        self.armed: bool = False
        self.held: bool = False
        self.notices: deque[tuple[int, str]] = deque(maxlen=REMEMBERED)
        self.chosen_speed: float = 0.0
        self.command_count = 0  # that stations have given
        self._chosen_number = (Mode.MANUAL, -1, "")
        self.chosen_mode: Mode = Mode.MANUAL
        self.interrupted: tuple[Mode, int] = Mode.MANUAL, -1  # when stations were lost: mode, commands

    def update(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message of the entity with this label.

        The first valid estimate of an aligned navigation gives home, but latitude and longitude 0 only until there is
        another. A new activity ends a requested hold.
        """
        ran = self.latest.motors_running
        self.latest.update(message, label, now)
        self.health.update(message, label, now, lands=self.latest.is_landing)
        match message:
            case imc.EstimatedState() if self.health.aligned and (
                self.home is None or self.home.lat == self.home.lon == 0.0
            ):
                home = positions.home_from_state(message, afloat=self.kind.afloat, undulation=self.undulation)
                self.home = home or self.home
            case imc.GpsFix() if sensors_from_imc.has_position(message):
                self.last_fix = message
            case imc.VehicleState():
                self.held = self.held and not is_maneuvering(message)
            case imc.ArmingState(state=state) if state != imc.ArmingState.State.ARMED:
                self.armed = self.armed and not ran
            case _:
                pass

    def age(self, received: float) -> float:
        """Time (s) since a message that arrived at a time."""
        return self._port.age(received)

    def forget_old(self) -> None:
        """Drop values that are no longer reported; a vehicle whose supervisor is silent is in a critical state."""
        self.health.supervisor_silent |= imc.VehicleState in self.latest.forget_old()

    @property
    def is_submerged(self) -> bool:
        state = self.latest.state
        return self.kind.afloat and state is not None and state.depth > SUBMERGED

    def station_keeping(self) -> imc.StationKeeping | None:
        """A station here, at the present depth or height; None while the position is unknown."""
        found = self.state_and_position()
        if found is None:
            return None
        place = found[1]
        if self.kind.afloat:
            z, units = max(0.0, -place.relative), DEPTH
        else:
            z, units = place.altitude + self.undulation, imc.ZUnits.HEIGHT
        return self.with_hold_radius(
            imc.StationKeeping(lat=place.lat, lon=place.lon, z=z, z_units=units, speed=self.guided_speed)
        )

    def with_hold_radius(self, station: imc.StationKeeping) -> imc.StationKeeping:
        """The station of an AUV under water on the circle of a hold, any other as it is."""
        if not (self.dives and station.z_units == DEPTH and station.z > SHALLOW):
            return station
        if not (radius := self.options.hold_radius):
            return station.replace(custom="Under Water=circle")
        return station.replace(radius=radius, custom=f"Minimum Radius={radius:g};Under Water=circle")

    @property
    def dives(self) -> bool:
        return self.kind.type == SUBMARINE

    @property
    def guided_speed(self) -> float:
        """The speed of what ground stations order, in m/s."""
        usual = self.options.guided_speed or self.options.hold_speed
        return min(self.chosen_speed or usual, self.limits.max_speed)

    def conversion_settings(self, name: str = "mavlink") -> ConversionContext:
        """The vehicle for which missions and orders become plans; `name` is the plan's."""
        return ConversionContext(
            self.kind,
            self.home,
            speed=self.guided_speed,
            deepest=self.limits.max_depth,
            highest=self.limits.max_altitude,
            fastest=self.limits.max_speed,
            area=self.limits.message,
            camera=self.camera,
            switch=SAVE_IMAGES,
            aloft=self.needs_no_takeoff,
            name=name,
        )

    @property
    def urgent_state(self) -> tuple[Mode, bool, bool]:
        """State that ground stations must receive immediately: mode, arming, an Abort."""
        return self.mode, self.armed_or_moving, self.health.aborted

    @property
    def mode(self) -> Mode:
        """Mode of the vehicle; HOLD also if a ground station asked for it and nothing else is done."""
        if self.airborne and self.latest.is_landing:
            return Mode.LAND
        vehicle = self.latest.vehicle
        stays = vehicle is not None and vehicle.maneuver_type == imc.StationKeeping.ID
        match self.active_guided_plan_id:
            case "hold":
                return Mode.HOLD
            case "goto" | "orbit":
                return Mode.HOLD if stays else Mode.GUIDED
            case "return":
                return Mode.RETURN
            case "land":
                return Mode.LAND
            case "follow":
                return Mode.OFFBOARD
            case "steered":
                return Mode.TELEOPERATION
            case "takeoff" if not stays:
                return Mode.TAKEOFF
            case _:
                mode = mode_of(vehicle, self.latest.plan, aloft=self.airborne)
                return Mode.HOLD if mode is Mode.MANUAL and self.held else mode

    @property
    def active_guided_plan_id(self) -> str:
        """Plan that the vehicle executes for a single order of a ground station; empty without one."""
        plan = self.latest.plan
        return (
            plan.plan_id
            if plan is not None and plan.plan_id in GUIDED_PLANS and is_maneuvering(self.latest.vehicle)
            else ""
        )

    @property
    def _stays_guided(self) -> bool:
        """Whether the last order was to go somewhere, and no hold: ArduPilot stays in GUIDED when it has arrived."""
        plan = self.latest.plan
        return plan is not None and plan.plan_id in ARRIVING_PLANS and not self.held

    @property
    def armed_or_moving(self) -> bool:
        """Whether the vehicle is armed over MAVLink, moving for any other reason, or has running motors."""
        return self.armed or is_maneuvering(self.latest.vehicle) or bool(self.latest.motors_running)

    @property
    def airborne(self) -> bool:
        """Whether the vehicle is an aircraft in the air, that is, with running motors."""
        return not self.kind.afloat and bool(self.latest.motors_running)

    @property
    def needs_no_takeoff(self) -> bool:
        """Whether the vehicle is an aircraft whose plans may begin without a Takeoff, as the plan engine sees it."""
        return not self.kind.afloat and is_airborne(self.latest.get(imc.VehicleMedium))

    @property
    def prearm_failure(self) -> str:
        """Reason why the vehicle cannot be armed; empty if it can."""
        return self.health.prearm_failure(self.latest.vehicle)

    def state_and_position(self) -> tuple[imc.EstimatedState, positions.GlobalPosition] | None:
        """The present estimate and its position; None if it is missing, old or impossible, or never was aligned."""
        state = self.latest.state if self.health.aligned else None
        place = self.position_from_state(state) if state is not None else None
        return (state, place) if state is not None and place is not None else None

    @property
    def located(self) -> bool:
        """Whether the position is known, and trusted by the navigation."""
        return self.state_and_position() is not None and self.health.position_trusted

    @property
    def is_inside_fence(self) -> bool | None:
        """Whether the vehicle is inside its fence; None if there is none, or the position is unknown."""
        found = self.state_and_position()
        return None if found is None else self.limits.contains(found[1].lat, found[1].lon)

    def position_from_state(self, state: imc.EstimatedState) -> positions.GlobalPosition | None:
        """The position in an estimate; None if it is impossible, or home is unknown."""
        if self.home is None:
            return None
        return positions.position_of(state, self.home, afloat=self.kind.afloat, undulation=self.undulation)

    def remember_mode_number(self, flavor: Flavor, mode: Mode, number: int) -> None:
        """Remember which of a mode's numbers a ground station has chosen: it expects to see that one."""
        self._chosen_number = mode, number, flavor.name
        self.chosen_mode = flavor.mode(self.kind, number) if number >= 0 else mode

    def custom_mode(self, flavor: Flavor) -> int:
        """The number of the present mode in a flavor."""
        if flavor.name == "ardupilot" and self.mode is Mode.HOLD and self._stays_guided:
            return flavor.custom_mode(self.kind, Mode.GUIDED)
        mode, number, name = self._chosen_number
        if (mode, name) == (self.mode, flavor.name) and number >= 0:
            return number
        return flavor.custom_mode(self.kind, self.mode)

    def intended_mode(self, flavor: Flavor) -> int:
        """The number of the intended mode: the present one, unless the vehicle has left it by itself."""
        mode, count = self.interrupted
        return flavor.custom_mode(self.kind, mode) if count == self.command_count else self.custom_mode(flavor)

    def utc(self, now: float) -> float:
        """The date that stations see, in s since 1970."""
        return now

    def state_boot_time_ms(self, state: imc.EstimatedState) -> int:
        """The time of an estimate in ms since the start."""
        return from_imc.boot_ms(state.timestamp, self.boot)
