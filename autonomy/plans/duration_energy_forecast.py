"""Forecast of a plan before it starts: durations, energy, and objections to it."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import accumulate

import imc
from autonomy.plans.estimate import (
    UNKNOWN_VERTICAL,
    LatLon,
    ManeuverEstimate,
    Powertrain,
    Vertical,
    estimate_maneuver,
)
from autonomy.plans.graph import PlanError, PlanGraph
from imc.tuple_list import parse_tuple_list
from support.number_parsing import leading_number

LONGEST_TEXT = 20_000  # bytes


@dataclass(frozen=True)
class PlanForecast:
    """Estimates by maneuver, along the first transitions from the start.

    `energy` is at least what the plan needs: it leaves out the maneuvers that are endless or whose duration is unknown.
    """

    graph: PlanGraph
    estimates: Mapping[str, ManeuverEstimate]
    energy: float  # J
    hotel: float  # J, of it
    calibration: float = 0.0  # s

    @property
    def seconds(self) -> float:
        """Duration (s) of the plan without calibration; infinite if endless, NaN if unknown."""
        return math.inf if self.graph.cyclical else math.fsum(e.seconds for e in self.estimates.values())

    def seconds_after(self, name: str) -> float:
        """Duration (s) of what comes after a maneuver."""
        _, *later = self.graph.sequence_from(name)
        names = [node.name for node in later]
        return math.fsum(self.estimates[name].seconds if name in self.estimates else math.nan for name in names)

    def statistics(self, capacity: float) -> imc.PlanStatistics:
        """Forecast as a message; fuel in % of `capacity` (J), empty if that is 0 or the duration is not finite."""
        total = self.seconds
        durations = {"Total": total + self.calibration, "Execution": total, "Calibration": self.calibration}
        durations |= {f"Maneuver {name}": e.seconds for name, e in self.estimates.items()}
        kinds = imc.PlanStatistics.Properties
        properties = (kinds.CYCLICAL if self.graph.cyclical else 0) | (kinds.INFINITE if math.isinf(total) else 0)
        if any(len(node.transitions) > 1 for node in self.graph.nodes.values()):
            properties |= kinds.NONLINEAR
        fuel = {"Total": self.energy, "Hotel": self.hotel, "Motion": self.energy - self.hotel}
        known = capacity > 0.0 and math.isfinite(total)
        shares = {name: 100.0 * value / capacity for name, value in fuel.items()} if known else {}
        distances = {f"Maneuver {name}": e.distance for name, e in self.estimates.items()}
        return imc.PlanStatistics(
            plan_id=self.graph.plan.plan_id,
            properties=properties,
            durations=format_tuple_list(durations, 1),
            distances=format_tuple_list({"Total": math.fsum(distances.values()), **distances}, 1),
            fuel=format_tuple_list(shares, 2),
        )


def forecast_plan(
    graph: PlanGraph, start: LatLon | None, train: Powertrain, now: float, vertical: Vertical = UNKNOWN_VERTICAL
) -> PlanForecast:
    """Estimate a plan from `start`, at a time (s since 1970 UTC) and, of an aerial vehicle, an altitude.

    Raises PlanError for a geometry that cannot be followed.
    """
    estimates: dict[str, ManeuverEstimate] = {}
    position, begin, rests = start, now, True
    chain = {node.name: node for node in graph.sequence_from(graph.start)}
    for node in (chain | graph.nodes).values():
        try:
            found = estimate_maneuver(node.maneuver, position, train, begin, vertical)
        except ValueError as error:
            raise PlanError(f"{node.name}: {error}") from None
        if len(estimates) < len(chain):
            ends_in_time = isinstance(node.maneuver, imc.FollowSystem | imc.ScheduledGoto)
            if rests and found.moving and not ends_in_time:
                found = found.delayed(train.run_up / found.speed)
            rests = not found.moving
            estimates[node.name], position, vertical = found, found.end, vertical.after(node.maneuver)
            begin += found.seconds if math.isfinite(found.seconds) else 0.0
    finite = [e for e in estimates.values() if math.isfinite(e.seconds)]
    hotel = train.hotel * math.fsum(e.seconds for e in finite)
    resting = max(0.0, train.power(0.0))
    motion = math.fsum(e.moving * train.power(e.speed) + max(0.0, e.seconds - e.moving) * resting for e in finite)
    return PlanForecast(graph, estimates, hotel + motion, hotel)


def feasibility_violations(forecast: PlanForecast, longest_leg: float, energy: float | None) -> Iterator[str]:
    """Objections to a plan: legs longer than `longest_leg` (m), less `energy` (J) than it needs, invalid fields."""
    for name, node in forecast.graph.nodes.items():
        maneuver, e = node.maneuver, forecast.estimates.get(name)
        if e is not None and e.longest > longest_leg:
            yield f"{name}: a leg of {e.longest / 1000.0:.1f} km is longer than {longest_leg / 1000.0:g} km"
        if getattr(maneuver, "speed", 1.0) <= 0.0:
            yield f"{name}: speed must be above 0"
        if isinstance(maneuver, imc.YoYo) and not (maneuver.amplitude > 0.0 and maneuver.pitch > 0.0):
            yield f"{name}: amplitude and pitch must be above 0"
        if isinstance(maneuver, imc.FollowPath) and not maneuver.points:
            yield f"{name}: path has no points"
    if energy is not None and forecast.energy > energy:
        needed, left = forecast.energy / 3600.0, energy / 3600.0
        yield f"the plan needs {round(needed):.6g} W h and the battery has {left:.0f} W h above its reserve"


def format_tuple_list(values: Mapping[str, float], digits: int) -> str:
    """IMC's text of named values: "Total=228.3,Execution=228.3".

    Values that are not finite are skipped, and so are the last ones if the text is too long for a message.
    """
    words = [f"{name}={value:.{digits}f}" for name, value in values.items() if math.isfinite(value)]
    ends = accumulate(len(word.encode(errors="surrogateescape")) + 1 for word in words)
    return ",".join(word for word, end in zip(words, ends, strict=True) if end <= LONGEST_TEXT)


def forecast_totals(statistics: imc.PlanStatistics) -> tuple[float, float]:
    """The duration (s) and the energy (% of a full battery) of a plan in its statistics; NaN if they are unknown."""
    return _total(statistics.durations), _total(statistics.fuel)


def _total(text: str) -> float:
    try:
        return leading_number(parse_tuple_list(text.replace(",", ";")).get("Total", ""))
    except ValueError:
        return math.nan
