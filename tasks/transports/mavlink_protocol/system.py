"""The vehicle as ground stations see it: its identity, its mode, its latest values."""

import hashlib
import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import imc
from mavlink import Dialect, Flavor, Mode, VehicleKind, is_moving, mode_of, positions, statustext
from mavlink.missions import ConversionContext
from mavlink.translate import from_imc, sensors_from_imc
from runtime.task import Entity
from tasks.transports.mavlink_protocol.figures import Figures
from tasks.transports.mavlink_protocol.file_tree import FileTree
from tasks.transports.mavlink_protocol.health import WORKING, Health
from tasks.transports.mavlink_protocol.helm import Helm, Outcome, Then, chain
from tasks.transports.mavlink_protocol.limits import Limits
from tasks.transports.mavlink_protocol.metadata import Metadata
from tasks.transports.mavlink_protocol.mission import ERRANDS, Mission
from tasks.transports.mavlink_protocol.mission_transfer import MissionTransfer
from tasks.transports.mavlink_protocol.named_values import NamedValue
from tasks.transports.mavlink_protocol.parameters import ParameterEntry, ParameterTable
from tasks.transports.mavlink_protocol.switches import Switches
from tasks.transports.mavlink_protocol.targets import Target
from tasks.transports.mavlink_protocol.transfers import Transfers

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.cameras import Camera

COMPONENT = 1
SUBMERGED = 0.3  # m
SHALLOW = 0.5  # m at which an AUV keeps station adrift
SUBMARINE = 12  # MAV_TYPE
HANDOVER = 2.0  # s of silence after which another station may steer
DEPTH = imc.ZUnits.DEPTH
REMEMBERED = 10
PICTURES = "Save Images"  # the option by which a camera takes pictures


class MavlinkSystem:
    """The state that all ground stations share.

    `publish` and `set_parameter(entry, text)` send requests to the vehicle with the id `imc_id`, `say(severity,
    text)` texts to all stations, and `reach(numbers)` tells them which items of the mission are over. `entities`
    gives the entities whose state counts for arming; `boot` is when the vehicle started, in s since 1970.
    `undulation` is the height of the geoid above the ellipsoid, in m. `rates()` are the rates of the messages
    streamed by default, in Hz, `speed()` is that of what ground stations ask for, in m/s, `hold_radius()` is in m,
    0 for the usual one, `takeoff_altitude()` in m above home. Stations can read the files in `folders`, by name.
    `cameras` are components of their own. `most` gives a limit of the profile, by its option. `switches` are the
    names of relays, lights and buttons. `helm` carries out what they ask for, by default with `publish`; `refusal`
    is why no order is taken, empty if they are.
    """

    def __init__(
        self,
        dialect: Dialect,
        *,
        name: str,
        system: int,
        imc_id: int,
        kind: VehicleKind,
        boot: float,
        undulation: float,
        rates: Callable[[], Mapping[str, float]],
        parameters: ParameterTable,
        entities: Callable[[], Iterable[Entity]],
        folders: Mapping[str, Path] = {},
        publish: Callable[[imc.Message], object],
        set_parameter: Callable[[ParameterEntry, str], None],
        say: Callable[[int, str], None],
        speed: Callable[[], float],
        hold_radius: Callable[[], float] = lambda: 0.0,
        takeoff_altitude: Callable[[], float] = lambda: 10.0,
        reach: Callable[[Sequence[int]], object] = lambda _: None,
        named_values: Sequence[NamedValue] = (),
        cameras: "Sequence[Camera]" = (),
        most: Callable[[str], float] = lambda _: math.inf,
        switches: tuple[Sequence[str], Sequence[str], Sequence[str]] = ((), (), ()),
        helm: Helm | None = None,
        refusal: str = "",
    ):
        self.dialect = dialect
        self.system = system
        self.imc_id = imc_id
        self.kind = kind
        self.parameters = parameters
        self.cameras = cameras
        self.helm = helm or Helm(publish, imc_id)
        self.refusal = refusal
        self.set_parameter = set_parameter
        self.say = say
        self._speed = speed
        self._hold_radius = hold_radius
        self.takeoff_altitude = takeoff_altitude
        self.named_values = named_values
        self.figures = Figures(lambda: [entity.label for entity in self.entities()])
        self.limits = Limits(self.figures, most)
        self.rates = rates
        self.home: positions.Home | None = None
        self.last_fix: imc.GpsFix | None = None
        self.armed = False
        self.held = False
        self.health = Health(entities)
        self.notices: deque[tuple[int, str]] = deque(maxlen=REMEMBERED)
        self.entities = entities
        self.boot = boot
        self.undulation = undulation
        self.uid = hashlib.sha256(name.encode(errors="surrogateescape")).digest()
        self.chosen_speed = 0.0
        self.orders = 0  # that stations have given
        self.mission = Mission(self.helm, self.mission_settings, lambda: self.limits.message, self._limit, reach)
        self.transfer = MissionTransfer(self.mission)
        self.target = Target(self)
        self.metadata = Metadata(name, parameters)
        described = {camera.definition_file: partial(getattr, camera, "definition") for camera in cameras}
        self.transfers = Transfers(FileTree({**self.metadata.files, **described}, folders))
        self.publish = publish
        self.switches = Switches(publish, imc_id, switches)
        self._steersman, self._steered_at = (0, 0, 0), -math.inf
        self._chosen, self.chosen = (Mode.MANUAL, -1, ""), Mode.MANUAL
        self.interrupted: tuple[Mode, int] = Mode.MANUAL, -1  # when stations were lost: mode, orders

    def hear(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message of the entity with this label.

        The first valid estimate of an aligned navigation gives home, but latitude and longitude 0 only until there is
        another. A new activity ends a requested hold.
        """
        ran = self.figures.motors
        self.figures.take(message, label, now)
        self.health.hear(message, label, now, lands=self.figures.lands)
        match message:
            case imc.EstimatedState() if self.health.aligned and (
                self.home is None or self.home.lat == self.home.lon == 0.0
            ):
                home = positions.home_of(message, afloat=self.kind.afloat, undulation=self.undulation)
                self.home = home or self.home
            case imc.GpsFix() if sensors_from_imc.has_position(message):
                self.last_fix = message
            case imc.PlanControlState():
                self.mission.hear(message, now)
            case imc.VehicleState():
                self.held = self.held and not is_moving(message)
            case imc.ArmingState(state=state) if state != imc.ArmingState.State.ARMED:
                self.armed = self.armed and not ran
            case _:
                pass

    def forget_old(self, now: float) -> None:
        """Forget what nobody reports any more; a vehicle whose supervisor is silent is in a critical state."""
        self.health.abandoned |= imc.VehicleState in self.figures.forget_old(now)

    def hold(self, now: float, then: Then = lambda _: None) -> None:
        """Hold: keep station here if it moves, is armed or is under water; otherwise only show the mode.

        A vehicle that cannot keep station at least stops.
        """
        vehicle = self.figures.vehicle
        able = vehicle is not None and vehicle.op_mode in WORKING
        holds = self.mode is Mode.HOLD and is_moving(vehicle)
        self.held = True
        if not able or holds or not (self.armed_or_moving or self._is_submerged):
            then(Outcome(True))
            return

        def judge(outcome: Outcome) -> None:
            if outcome.done:
                then(outcome)
            else:
                self.say(statustext.WARNING, f"Cannot hold, stopping: {outcome.reason}")
                self.helm.stop(now, then)

        station = self._station()
        if station is None:
            judge(Outcome(False, "the position is unknown"))
        else:
            self.helm.start(chain("hold", [station]), judge, now)

    def abort(self, now: float) -> None:
        """Abort what the vehicle does."""
        abort = imc.Abort(dst=self.imc_id)
        self.publish(abort)
        self.hear(abort, "", now)  # a task does not hear itself
        self.say(statustext.EMERGENCY, "Abort")

    @property
    def _is_submerged(self) -> bool:
        state = self.figures.state
        return self.kind.afloat and state is not None and state.depth > SUBMERGED

    def _station(self) -> imc.StationKeeping | None:
        """Here, at the present depth or height."""
        found = self.place()
        if found is None:
            return None
        place = found[1]
        if self.kind.afloat:
            z, units = max(0.0, -place.relative), DEPTH
        else:
            z, units = place.altitude + self.undulation, imc.ZUnits.HEIGHT
        return self.close(imc.StationKeeping(lat=place.lat, lon=place.lon, z=z, z_units=units, speed=self.speed))

    def close(self, station: imc.StationKeeping) -> imc.StationKeeping:
        """The station of an AUV under water on the circle of a hold, any other as it is."""
        radius = self._hold_radius()
        if not (radius and self.dives and station.z_units == DEPTH and station.z > SHALLOW):
            return station
        return station.replace(radius=radius, custom=f"Minimum Radius={radius:g}")

    @property
    def dives(self) -> bool:
        return self.kind.type == SUBMARINE

    def steered_by(self, steersman: tuple[int, int, int], now: float) -> bool:
        """Whether a component may steer now: the one that does, until it falls silent."""
        if self._steersman != steersman and now - self._steered_at < HANDOVER:
            return False
        self._steersman, self._steered_at = steersman, now
        return True

    @property
    def speed(self) -> float:
        """The speed of what ground stations ask for, in m/s."""
        return min(self.chosen_speed or self._speed(), self.limits.fastest)

    def mission_settings(self, name: str = "mavlink") -> ConversionContext:
        """The vehicle for which missions and orders become plans; `name` is the plan's."""
        return ConversionContext(
            self.kind,
            self.home,
            speed=self.speed,
            deepest=self.limits.deepest,
            highest=self.limits.highest,
            fastest=self.limits.fastest,
            area=self.limits.message,
            camera=next((camera.label for camera in self.cameras if camera.takes_pictures), ""),
            switch=PICTURES,
            aloft=self.aloft,
            name=name,
        )

    def _limit(self, limits: imc.Message) -> None:
        self.publish(limits.replace(dst=self.imc_id))

    @property
    def shown(self) -> tuple[tuple[Mode, bool, bool], tuple[int, int, int]]:
        """What ground stations must learn immediately: mode, arming, an Abort; state and progress of the mission."""
        return (self.mode, self.armed_or_moving, self.health.aborted), self.mission.progress

    @property
    def mode(self) -> Mode:
        """What the vehicle does; HOLD also if a ground station asked for it and nothing else goes on."""
        if self.aloft and self.figures.lands:
            return Mode.LAND
        vehicle = self.figures.vehicle
        stays = vehicle is not None and vehicle.maneuver_type == imc.StationKeeping.ID
        match self.errand:
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
                mode = mode_of(vehicle, self.figures.plan, aloft=self.aloft)
                return Mode.HOLD if mode is Mode.MANUAL and self.held else mode

    @property
    def errand(self) -> str:
        """What a ground station has asked for and the vehicle does, by a single order; empty if nothing."""
        plan = self.figures.plan
        return plan.plan_id if plan is not None and plan.plan_id in ERRANDS and is_moving(self.figures.vehicle) else ""

    @property
    def armed_or_moving(self) -> bool:
        """Whether it is armed over MAVLink, moving for any other reason, or has running motors."""
        return self.armed or is_moving(self.figures.vehicle) or bool(self.figures.motors)

    @property
    def aloft(self) -> bool:
        """Whether it is an aircraft in the air, that is, with running motors."""
        return not self.kind.afloat and bool(self.figures.motors)

    @property
    def obstacle(self) -> str:
        """Why the vehicle cannot be armed; empty if it can."""
        return self.health.obstacle(self.figures.vehicle)

    def place(self) -> tuple[imc.EstimatedState, positions.GlobalPosition] | None:
        """The present estimate and its position; None if it is missing, old or impossible, or never was aligned."""
        state = self.figures.state if self.health.aligned else None
        place = self.position(state) if state is not None else None
        return (state, place) if state is not None and place is not None else None

    @property
    def located(self) -> bool:
        """Whether the position is known, and trusted by the navigation."""
        return self.place() is not None and self.health.navigates

    @property
    def is_inside(self) -> bool | None:
        """Whether the vehicle is inside its fence; None if there is none, or the position is unknown."""
        found = self.place()
        return None if found is None else self.limits.holds(found[1].lat, found[1].lon)

    def position(self, state: imc.EstimatedState) -> positions.GlobalPosition | None:
        """The position in an estimate; None if it is impossible, or home is unknown."""
        if self.home is None:
            return None
        return positions.position_of(state, self.home, afloat=self.kind.afloat, undulation=self.undulation)

    def remember(self, severity: int, words: str) -> None:
        """Keep a notice for ground stations that connect later."""
        self.notices.append((severity, words))

    def choose_number(self, flavour: Flavor, mode: Mode, number: int) -> None:
        """Remember which of a mode's numbers a ground station has chosen: it expects to see that one."""
        self._chosen = mode, number, flavour.name
        self.chosen = flavour.mode(self.kind, number) if number >= 0 else mode

    def custom_mode(self, flavour: Flavor) -> int:
        """The number of the present mode in a flavor."""
        mode, number, name = self._chosen
        if (mode, name) == (self.mode, flavour.name) and number >= 0:
            return number
        return flavour.custom_mode(self.kind, self.mode)

    def intended_mode(self, flavour: Flavor) -> int:
        """The number of the mode that people want: the present one, unless the vehicle has left it by itself."""
        mode, orders = self.interrupted
        return flavour.custom_mode(self.kind, mode) if orders == self.orders else self.custom_mode(flavour)

    def utc(self, now: float) -> float:
        """The date that stations see, in s since 1970."""
        return now

    def time(self, state: imc.EstimatedState) -> int:
        """The time of an estimate in ms since the start."""
        return from_imc.boot_ms(state.timestamp, self.boot)
