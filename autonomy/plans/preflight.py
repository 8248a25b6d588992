"""The check of a plan before it starts."""

import math
from collections.abc import Callable, Collection, Iterator
from functools import partial
from itertools import chain

import imc
from autonomy.limits import OperatingLimits
from autonomy.plans.duration_energy_forecast import PlanForecast, feasibility_violations, forecast_plan
from autonomy.plans.estimate import UNKNOWN_VERTICAL, Powertrain, Vertical
from autonomy.plans.graph import ROUNDING, PlanError, PlanGraph, parse_graph
from autonomy.plans.limit_violations import PlanBounds, area_violations, depth_violations, flight_violations
from autonomy.plans.value_ranges import value_range_violations
from imc.coordinates import absolute_position
from support.number_parsing import leading_number, leading_numbers

OptionReader = Callable[[str], str]
SectionReader = Callable[[str, str], str]


class PreflightOptionError(ValueError):
    """The value of an option of the profile is invalid: `option` is its name, `reason` is the cause."""

    def __init__(self, option: str, reason: str):
        super().__init__(f"{option}: {reason}")
        self.option = option
        self.reason = reason


class Preflight:
    """Checks plans against the limits in the section General of a profile; `value` returns an option of it.

    `hotel` is the power (W) without propulsion, `longest_leg` is in m. `elsewhere` returns an option of another
    section: those of maneuvers and path control decide how long they take. Raises PreflightOptionError.
    """

    def __init__(self, value: OptionReader, hotel: float, longest_leg: float, elsewhere: SectionReader | None = None):
        usual, elsewhere = Powertrain(), elsewhere or _without_options
        self._limits = OperatingLimits.from_options(
            partial(_number, value), deepest=math.inf, highest=math.inf, fastest=math.inf
        )
        if not self._limits.deepest >= 0.0:
            raise PreflightOptionError("Absolute Maximum Depth", f"must be 0 m or more, not {self._limits.deepest:g} m")
        self.capacity: float = 3600.0 * _number(value, "Battery Capacity", 0.0)  # J
        self._longest_leg = longest_leg
        self._train = Powertrain(
            _table(value, "Speed Conversion -- MPS") or usual.speeds,
            _table(value, "Speed Conversion -- RPM") or usual.rpms,
            _table(value, "Speed Conversion -- Actuation") or usual.actuations,
            _table(value, "Power Model -- Conversion - RPM") or usual.power_rpms,
            _table(value, "Power Model -- Conversion - Watt", rising=False) or usual.powers,
            hotel,
            _number(value, "Time Of Arrival Factor", usual.ahead),
            elsewhere("Maneuver.StationKeeping", "Under Water").strip().lower() == "circle",
            _foreign_number(elsewhere, "Control.UAV.Path", "Maximum Acceleration", usual.acceleration),
            _foreign_number(elsewhere, "Maneuver.ScheduledGoto", "Minimum Speed", usual.slowest),
            _foreign_number(elsewhere, "Maneuver.ScheduledGoto", "Maximum Speed", usual.fastest),
            _foreign_number(elsewhere, "Maneuver.CompassCalibration", "Number Of Turns", usual.turns),
            _number(value, "Run-Up Distance", usual.run_up),
        )
        if not 0.0 <= self._train.run_up < math.inf:
            raise PreflightOptionError("Run-Up Distance", f"must be 0 m or more, not {self._train.run_up:g} m")
        if not len(self._train.speeds) == len(self._train.rpms) == len(self._train.actuations):
            raise PreflightOptionError("Speed Conversion -- MPS", "must have as many values as RPM and Actuation")
        if len(self._train.power_rpms) != len(self._train.powers):
            raise PreflightOptionError("Power Model -- Conversion - RPM", "must have as many values as Watt")

    def check(
        self,
        plan: imc.PlanSpecification,
        supported: Collection[int],
        state: imc.EstimatedState | None,
        fuel: float | None,
        now: float,
        limits: imc.OperationalLimits | None = None,
        airborne: bool = False,
    ) -> PlanForecast:
        """Estimate a plan from the position of the vehicle with `fuel` (%) left. Raises PlanError if it is rejected.

        A vehicle that supports Takeoff is aerial; `airborne` is True if it is in the air already.
        """
        present = self._limits.tightened(limits) if limits is not None else self._limits
        graph = parse_graph(plan, supported)
        violations = depth_violations(graph, present.deepest)
        for reason in chain(violations, speed_violations(graph, present.fastest), value_range_violations(graph)):
            raise PlanError(reason)
        position = absolute_position(state)[:2] if state is not None else None
        ground = state.height - state.z - state.alt if state is not None and state.alt >= 0.0 else None
        vertical = UNKNOWN_VERTICAL
        if state is not None and ground is not None:
            vertical = Vertical(state.alt if airborne else 0.0, ground)
        forecast = forecast_plan(graph, position, self._train, now, vertical)
        energy = self.capacity * fuel / 100.0 if fuel is not None and self.capacity else None
        bounds = PlanBounds(limits, self._limits.highest, ground, airborne)
        flies = flight_violations(graph, bounds) if imc.Takeoff.ID in supported else ()
        for reason in chain(
            flies, area_violations(graph, bounds), feasibility_violations(forecast, self._longest_leg, energy)
        ):
            raise PlanError(reason)
        return forecast


def speed_violations(graph: PlanGraph, fastest: float) -> Iterator[str]:
    """Objections to maneuvers with a speed above `fastest` (m/s) or 100 %."""
    for name, node in graph.nodes.items():
        speed = getattr(node.maneuver, "speed", 0.0)
        units = getattr(node.maneuver, "speed_units", None)
        if units == imc.SpeedUnits.METERS_PS and speed > fastest + ROUNDING:
            yield f"{name}: a speed of {speed:g} m/s is above the vehicle's {fastest:g} m/s"
        if units == imc.SpeedUnits.PERCENTAGE and speed > 100.0:
            yield f"{name}: a speed of {speed:g} % is above 100 %"


def _number(value: OptionReader, option: str, default: float) -> float:
    text = value(option)
    try:
        return leading_number(text) if text else default
    except ValueError:
        raise PreflightOptionError(option, f"{text!r} is not a number") from None


def _without_options(section: str, option: str) -> str:
    return ""


def _foreign_number(elsewhere: SectionReader, section: str, option: str, default: float) -> float:
    """A positive number of another section, whose own task reports a wrong one; else the default."""
    try:
        number = leading_number(elsewhere(section, option))
    except ValueError:
        return default
    return number if 0.0 < number < math.inf else default


def _table(value: OptionReader, option: str, *, rising: bool = True) -> list[float]:
    """The numbers of a table, by default rising ones; empty if the option is empty.

    One number above 0 is a proportion, a line from 0 through it, as in the power model of DUNE.
    """
    text = value(option)
    try:
        table = leading_numbers(text)
    except ValueError:
        raise PreflightOptionError(option, f"{text!r} are not numbers") from None
    if not all(map(math.isfinite, table)):
        raise PreflightOptionError(option, f"{text!r} has a number that is not finite")
    if len(table) == 1:
        table.insert(0, 0.0)
    if rising and sorted(table) != table:
        raise PreflightOptionError(option, "needs rising numbers")
    return table
