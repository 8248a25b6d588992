"""The check of a plan before it starts."""

import math
from collections.abc import Callable, Collection, Iterator
from itertools import chain

import imc
from imc.coordinates import absolute
from runtime.task import ParameterError
from tasks.plan.bounds import Bounds, grounded, outside
from tasks.plan.estimate import Powertrain
from tasks.plan.graph import ROUNDING, Graph, PlanError, parse
from tasks.plan.outlook import Outlook, foresee, objections
from tasks.plan.ranges import beyond

Value = Callable[[str], str]


class Preflight:
    """Checks plans against the limits in the section General of a profile; `value` returns an option of it.

    `hotel` is the power (W) without propulsion, `longest_leg` is in m. Raises ParameterError for an invalid option.
    """

    def __init__(self, value: Value, hotel: float, longest_leg: float):
        usual = Powertrain()
        self.deepest = _number(value, "Absolute Maximum Depth", math.inf)
        if not self.deepest >= 0.0:
            raise ParameterError("Absolute Maximum Depth", f"must be 0 m or more, not {self.deepest:g} m")
        self._highest = _number(value, "Absolute Maximum Altitude", math.inf)
        self._fastest = _number(value, "Maximum Absolute Speed", math.inf)
        self.capacity = 3600.0 * _number(value, "Battery Capacity", 0.0)  # J
        self._longest_leg = longest_leg
        self._train = Powertrain(
            _table(value, "Speed Conversion -- MPS") or usual.speeds,
            _table(value, "Speed Conversion -- RPM") or usual.rpms,
            _table(value, "Speed Conversion -- Actuation") or usual.actuations,
            _table(value, "Power Model -- Conversion - RPM") or usual.power_rpms,
            _table(value, "Power Model -- Conversion - Watt") or usual.powers,
            hotel,
            _number(value, "Time Of Arrival Factor", usual.ahead),
        )
        if not len(self._train.speeds) == len(self._train.rpms) == len(self._train.actuations):
            raise ParameterError("Speed Conversion -- MPS", "must have as many values as RPM and Actuation")
        if len(self._train.power_rpms) != len(self._train.powers):
            raise ParameterError("Power Model -- Conversion - RPM", "must have as many values as Watt")

    def check(
        self,
        plan: imc.PlanSpecification,
        supported: Collection[int],
        state: imc.EstimatedState | None,
        fuel: float | None,
        now: float,
        limits: imc.OperationalLimits | None = None,
        aloft: bool = False,
    ) -> Outlook:
        """Estimate a plan from the position of the vehicle with `fuel` (%) left. Raises PlanError if it is refused.

        A vehicle that supports Takeoff is aerial; `aloft` is True if it is in the air already.
        """
        deepest = self.deepest
        if limits is not None and limits.mask & imc.OpLimitsMask.MAX_DEPTH:
            deepest = min(deepest, limits.max_depth)
        fastest = self._fastest
        if limits is not None and limits.mask & imc.OpLimitsMask.MAX_SPEED:
            fastest = min(fastest, limits.max_speed)
        graph = parse(plan, supported, deepest)
        for reason in chain(too_fast(graph, fastest), beyond(graph)):
            raise PlanError(reason)
        position = absolute(state)[:2] if state is not None else None
        outlook = foresee(graph, position, self._train, now)
        energy = self.capacity * fuel / 100.0 if fuel is not None and self.capacity else None
        ground = state.height - state.z - state.alt if state is not None and state.alt >= 0.0 else None
        bounds = Bounds(limits, self._highest, ground, aloft)
        flies = grounded(graph, bounds) if imc.Takeoff.ID in supported else ()
        for reason in chain(flies, outside(graph, bounds), objections(outlook, self._longest_leg, energy)):
            raise PlanError(reason)
        return outlook


def too_fast(graph: Graph, fastest: float) -> Iterator[str]:
    """Objections to maneuvers with a speed above `fastest` (m/s) or 100 %."""
    for name, node in graph.nodes.items():
        speed = getattr(node.maneuver, "speed", 0.0)
        units = getattr(node.maneuver, "speed_units", None)
        if units == imc.SpeedUnits.METERS_PS and speed > fastest + ROUNDING:
            yield f"{name}: a speed of {speed:g} m/s is above the vehicle's {fastest:g} m/s"
        if units == imc.SpeedUnits.PERCENTAGE and speed > 100.0:
            yield f"{name}: a speed of {speed:g} % is above 100 %"


def _number(value: Value, option: str, default: float) -> float:
    text = value(option)
    try:
        return float(text) if text else default
    except ValueError:
        raise ParameterError(option, f"{text!r} is not a number") from None


def _table(value: Value, option: str) -> list[float]:
    """Two or more rising numbers; empty if the option is empty."""
    text = value(option)
    try:
        table = [float(word) for word in text.split(",")] if text else []
    except ValueError:
        raise ParameterError(option, f"{text!r} are not numbers") from None
    if table and (len(table) < 2 or sorted(table) != table):
        raise ParameterError(option, "needs two or more rising numbers")
    return table
