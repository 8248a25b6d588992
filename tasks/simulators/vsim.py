"""Simulates the vehicle, moved by its fins, thrusters, water and wind."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar

import imc
from runtime import ParameterError, State, consume, param, periodic
from runtime.task import SharedOption
from support.diagnostics import ConfigWarning
from support.rotations import Vector
from support.terminal_text import corrected_spelling, printable, quoted
from support.wgs84 import is_on_earth, offset
from tasks.simulated_world import chart_warnings, log_chart, log_unknown_depth, world_of
from tasks.simulators.fixed_steps import FixedSteps
from tasks.simulators.powered_device import PoweredDeviceTask
from tasks.true_motion import simulated_state
from world import SECTIONS
from world.bodies import (
    Boat,
    BoatModel,
    BoatMotion,
    ModelError,
    UnderwaterModel,
    UnderwaterVehicle,
    is_boat_model,
    is_estimated_model,
    motion_in_waves,
    read_boat_model,
    read_underwater_model,
)
from world.sea import SeabedContact

MODEL = "VSIM/Model/"
MANUAL_INPUT = imc.GpsFix.Type.MANUAL_INPUT
AFLOAT = 2.0  # s without a touch, after which the vehicle is no longer aground
PATIENCE = 2.0  # s without a step, after which actuators stop, as the motor controllers and servos of a vehicle do
VALID_POS = imc.GpsFix.Validity.VALID_POS


class VSIM(PoweredDeviceTask):
    """Moves an underwater vehicle in six degrees of freedom, or a boat in three, and publishes the truth.

    The model is the section [VSIM/Model/<Vehicle Type>] of the profile; its option Type selects one of the two. The
    vehicle starts at rest at the position of the first manual GpsFix; a later one, of its own or addressed to it, moves
    it there and keeps its depth, attitude and velocities. In SimulatedState, lat, lon and height are those of the fix,
    and u, v, w are velocities through the water. AbsoluteWind (where it comes from) moves boats only, and so do waves,
    if the profile sets Wave Height of [World]. Without power the thrusters do not turn. The bottom of the sea is that
    of [World]; a vehicle that touches it stops there.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS

    transient: ClassVar[tuple[str, ...]] = ("_seabed", "_sea")

    execution_frequency: float = param(100.0, "Hz", "Rate of SimulatedState.", minimum=20, maximum=1000, editable=False)
    initial_heading: float = param(0.0, "°", "Heading at the start, true north.", minimum=-360, maximum=360)
    initial_depth: float = param(0.0, "m", "Depth at the start, of a vehicle that dives.", minimum=0, maximum=11000)
    stream_source: str = param(
        "Stream Velocity Simulator",
        "",
        "Entity whose EstimatedStreamVelocity is the true one.",
        name="Entity Label - Stream Velocity Source",
    )
    time_multiplier: float = param(
        1.0, "1", "Not used, kept for DUNE's profiles; the clock is an option of each run.", editable=False
    )

    def configure(self) -> None:
        try:
            self._model = self._read(self.vehicle.profile.value)
        except ModelError as error:
            raise ParameterError("Vehicle Type", str(error)) from None
        if self.initial_depth and isinstance(self._model, BoatModel):
            raise ParameterError("Initial Depth", "a boat floats")
        world = world_of(self)
        self._seabed, self._has_chart = world.seabed, world.chart is not None
        self._sea = world.wind_sea(self.vehicle.seed) if isinstance(self._model, BoatModel) else None

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        yield from chart_warnings(self)
        read = {"Integration Method"}

        def value(section: str, option: str) -> str:
            read.add(option)
            return self.vehicle.profile.value(section, option)

        self._read(value)
        name = self._vehicle_type()
        section, others = f"{MODEL}{name}", list[str]()
        for option in self.vehicle.profile.options(section):
            if option not in read and (near := corrected_spelling(option, read)):
                yield ConfigWarning(option, f"nothing reads {quoted(option)}", f"did you mean {quoted(near)}?", section)
            elif option not in read:
                others.append(option)
        words = f"nothing reads {', '.join(map(quoted, others))}"
        if is_estimated_model(value, name):
            yield ConfigWarning(
                "Type", f"DUNE's model of a boat is estimated from Mass and Volume; {words}", "", section
            )
        elif others:
            yield ConfigWarning(others[0], words, "", section)

    def start(self) -> None:
        self.craft: Boat | UnderwaterVehicle = self._craft()
        self._origin: imc.GpsFix | None = None
        self._start = (0.0, 0.0)
        self._grounding = SeabedContact()
        self._touched: float | None = None
        self._is_off_chart = False
        log_chart(self)
        self._unknown: set[tuple[str, int]] = set()
        self._steps = FixedSteps(self.execution_frequency, PATIENCE)
        self.set_entity_state(State.BOOT, "waiting for the start position")

    def water_depth_at(self, lat: float, lon: float) -> float:
        """Depth of the water (m) at a place (rad); infinite if the bottom is not known."""
        return math.inf if self._seabed is None else self._seabed.depth(*offset(*self._seabed.reference, lat, lon))

    def max_depth_at(self, lat: float, lon: float) -> float:
        """The largest depth of the vehicle at a place (rad) with its hull above the bottom (m)."""
        return self.water_depth_at(lat, lon) - self._craft().draft

    def _craft(self) -> Boat | UnderwaterVehicle:
        return Boat(self._model) if isinstance(self._model, BoatModel) else UnderwaterVehicle(self._model)

    def _vehicle_type(self) -> str:
        return self.vehicle.profile.value("General", "Vehicle Type", "lauv")

    def _read(self, value: Callable[[str, str], str]) -> UnderwaterModel | BoatModel:
        """Read the model; `value(section, option)` returns its texts. Raises ModelError."""
        name = self._vehicle_type()
        if not self.vehicle.profile.options(f"{MODEL}{name}"):
            near = name.lower() if self.vehicle.profile.options(f"{MODEL}{name.lower()}") else ""
            hint = f" (did you mean {quoted(near)}?)" if near else ""
            raise ModelError(f"no section [{MODEL}{printable(name)}] describes this vehicle{hint}")
        return read_boat_model(value, name) if is_boat_model(value, name) else read_underwater_model(value, name)

    @consume(others=True)
    def set_start_position(self, fix: imc.GpsFix) -> None:
        if fix.type != MANUAL_INPUT or (fix.src != self.system and fix.dst != self.system):
            return
        if not (is_on_earth(fix.lat, fix.lon) and math.isfinite(fix.height)):
            self.log.warning(f"a manual fix is not a position on Earth: {fix.lat}, {fix.lon} rad, {fix.height} m")
            return
        before = self._origin
        if before is not None and (before.lat, before.lon) == (fix.lat, fix.lon) and not fix.validity & VALID_POS:
            return  # a receiver that lost its fix repeats the last position
        if self._origin is None:
            self.craft.set_attitude(0.0, 0.0, math.radians(self.initial_heading))
            if isinstance(self.craft, UnderwaterVehicle):
                self.craft.z = self.initial_depth
        self.craft.x = self.craft.y = 0.0
        self._origin = fix
        origin = world_of(self).origin
        self._start = (0.0, 0.0) if origin is None else offset(*origin, fix.lat, fix.lon)
        if self._seabed is not None:
            wanted = self.craft.z
            self._grounding.reset(self.craft, *offset(*self._seabed.reference, fix.lat, fix.lon), self._seabed)
            if self.craft.z < wanted:
                water = max(0.0, self.water_depth_at(fix.lat, fix.lon))
                words = f"it begins at {self.craft.z:.1f} m, not at {wanted:g} m"
                self.log.warning(f"the water is {water:.1f} m deep here: {words}")
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_servo_position(self, position: imc.ServoPosition) -> None:
        if self._accepts("fin", position.id, position.value, len(self.craft.deflections)):
            self.craft.set_deflection(position.id, position.value)

    @consume
    def on_set_thruster_actuation(self, actuation: imc.SetThrusterActuation) -> None:
        if self._accepts("thruster", actuation.id, actuation.value, len(self.craft.actuations)):
            self.craft.set_actuation(actuation.id, actuation.value if self.has_power else 0.0)

    def on_power_loss(self) -> None:
        for number in range(len(self.craft.actuations)):
            self.craft.set_actuation(number, 0.0)

    @consume
    def on_stream_velocity(self, stream: imc.EstimatedStreamVelocity) -> None:
        label = self.vehicle.entities.label(stream.src, stream.src_ent)
        velocity = stream.x, stream.y, stream.z
        if label == self.stream_source and all(map(math.isfinite, velocity)):
            self.craft.stream = velocity

    @consume
    def on_wind(self, wind: imc.AbsoluteWind) -> None:
        if isinstance(self.craft, Boat) and math.isfinite(wind.direction) and math.isfinite(wind.speed):
            self.craft.wind = -wind.speed * math.cos(wind.direction), -wind.speed * math.sin(wind.direction)

    @periodic("execution_frequency")
    def simulate(self, periods: int) -> None:
        origin, craft = self._origin, self.craft
        if origin is None:
            self._steps.skip_periods(self.now_ns, periods)
            return
        if stall := self._steps.run(self.now_ns, periods, self._step, self._release):
            self.log.warning(stall)
        (x, y, z), velocity, angles, rates = self._motion()
        if self._has_chart:
            self._is_off_chart = log_unknown_depth(self, self._start[0] + x, self._start[1] + y, self._is_off_chart)
        start, time = (origin.lat, origin.lon, origin.height), self._steps.time
        self.publish(simulated_state((x, y, z), velocity, angles, rates, craft.stream, start, time), keep_time=True)

    def _motion(self) -> BoatMotion | tuple[Vector, Vector, Vector, Vector]:
        craft = self.craft
        if self._sea is not None and isinstance(craft, Boat):
            return motion_in_waves(craft, self._sea, self._start, self._steps.time - self.vehicle.start_time)
        place, velocity, rates = (craft.x, craft.y, craft.z), (craft.u, craft.v, craft.w), (craft.p, craft.q, craft.r)
        return place, velocity, craft.euler_angles(), rates

    def _step(self, seconds: float) -> None:
        self.craft.step(seconds)
        if self._seabed is not None:
            water = self._grounding.apply(self.craft, self._seabed, seconds)
            if water is not None or self._touched is not None:
                self._report_ground(water)

    def _report_ground(self, water: float | None) -> None:
        """Report when the vehicle touches the bottom in `water` (m), and when it is free again."""
        if water is not None:
            if self._touched is None:
                self.log.warning(f"grounded in {max(0.0, water):.1f} m of water")
            self._touched = self.now
        elif self._touched is not None and self.now - self._touched > AFLOAT:
            self._touched = None
            self.log.info("no longer grounded")

    def _release(self) -> None:
        """Stop the actuators."""
        for fin in range(len(self.craft.deflections)):
            self.craft.set_deflection(fin, 0.0)
        for thruster in range(len(self.craft.actuations)):
            self.craft.set_actuation(thruster, 0.0)

    def _accepts(self, what: str, number: int, value: float, count: int) -> bool:
        if number < count and math.isfinite(value):
            return True
        if (what, number) not in self._unknown:
            self._unknown.add((what, number))
            reason = f"{value} is not a number" if number < count else f"the model has {count}"
            self.log.warning(f"a command for {what} {number} has no effect: {reason}")
        return False
