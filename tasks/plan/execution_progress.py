"""A plan in execution: its request, its estimates and its progress."""

import math
from dataclasses import dataclass, field

import imc
from autonomy.plans import ManeuverEstimate, PlanForecast, PlanNode, format_tuple_list
from runtime import Script
from tasks.plan.actions import PlanActions

UNKNOWN_ESTIMATE = ManeuverEstimate()
UNKNOWN_ETA = 0xFFFF
UNKNOWN = -1
NO_MANEUVER = 0xFFFF  # no maneuver
DUPLICATE_WINDOW = 2.0  # s within which an equal request is a duplicate
BRIEF = 1.0  # s; a maneuver that ends sooner has done nothing
ORDINARY_INFO = ("", "done")


@dataclass
class PlanExecution:
    """One START, from its request on; fields are None until known. Times are in s."""

    request: imc.PlanControl
    began: float
    script: Script | None = None
    forecast: PlanForecast | None = None
    actions: PlanActions | None = None
    statistics: imc.PlanStatistics | None = None
    node: PlanNode | None = None
    node_began: float = 0.0
    durations: dict[str, float] = field(default_factory=dict[str, float])
    commanding: bool = False
    info: str = ""
    progress: float = -1.0
    notes: list[str] = field(default_factory=list[str])
    brief_maneuvers: list[str] = field(default_factory=list[str])

    def is_repeated_request(self, request: imc.PlanControl, now: float) -> bool:
        """Whether a request is a duplicate of the one that started this plan."""
        same = request.replace(timestamp=self.request.timestamp) == self.request
        return same and now - self.began < DUPLICATE_WINDOW

    def begin_maneuver(self, node: PlanNode, now: float) -> None:
        """A maneuver begins."""
        self.node, self.node_began = node, now
        if self.actions is not None:
            self.actions.begin_maneuver(node)

    def add_note(self, text: str) -> None:
        """The maneuver is done, but reports a fault."""
        if self.node is not None and text not in ORDINARY_INFO:
            self.notes.append(f"{self.node.name}: {text}")

    @property
    def instant_loop(self) -> list[str]:
        """The maneuvers that have led back to this one, none of which has lasted; empty if there is no such loop.

        Their conditions hold at once: the vehicle would switch between them for ever and do nothing.
        """
        if self.node is None or self.node.name not in self.brief_maneuvers:
            return []
        return [*self.brief_maneuvers[self.brief_maneuvers.index(self.node.name) :], self.node.name]

    def end_maneuver(self, now: float) -> None:
        """The maneuver ends."""
        if self.node is not None:
            lasted = self.durations[f"Maneuver {self.node.name}"] = now - self.node_began
            self.brief_maneuvers = [] if lasted >= BRIEF else [*self.brief_maneuvers, self.node.name]
            if self.actions is not None:
                self.actions.end_maneuver(self.node)

    def maneuver_eta(self, vehicle: imc.VehicleState | None) -> int:
        """Time left that the maneuver reports, UNKNOWN if it reports none."""
        # A VehicleState with an earlier start time still has the ETA of the maneuver before.
        if self.node is None or vehicle is None or vehicle.maneuver_stime < self.node_began - 1e-6:
            return UNKNOWN
        return UNKNOWN if vehicle.maneuver_eta == UNKNOWN_ETA else vehicle.maneuver_eta

    def maneuver_time_left(self, vehicle: imc.VehicleState | None, now: float) -> float:
        """Time left of the maneuver: as it reports, but at most the estimate."""
        if self.node is None or self.forecast is None:
            return math.nan
        expected = self.forecast.estimates.get(self.node.name)
        duration = math.nan if expected is None else expected.seconds
        eta = self.maneuver_eta(vehicle)
        if math.isnan(duration):
            return duration if eta == UNKNOWN else float(eta)
        return max(0.0, duration - (now - self.node_began)) if eta == UNKNOWN else min(float(eta), duration)

    def time_left(self, vehicle: imc.VehicleState | None, now: float) -> float:
        """Time left of the plan; NaN if unknown, infinite if endless."""
        if self.forecast is None:
            return math.nan
        if self.node is None:
            return self.forecast.seconds
        if self.forecast.graph.cyclical:
            return math.inf
        return self.maneuver_time_left(vehicle, now) + self.forecast.seconds_after(self.node.name)

    def update_progress(self, left: float) -> float:
        """Progress (%) with `left` s to go; it never decreases. -1 if unknown."""
        total = math.nan if self.forecast is None else self.forecast.seconds + self.forecast.calibration
        if math.isfinite(left) and math.isfinite(total) and total > 0.0 and self.node is not None:
            self.progress = max(self.progress, 100.0 * min(1.0, max(0.0, 1.0 - left / total)))
        return self.progress

    def activate_ahead(self, vehicle: imc.VehicleState | None, now: float) -> None:
        """Activate in time what the following maneuvers need."""
        if self.forecast is not None and self.actions is not None and self.node is not None:
            estimates, left = self.forecast.estimates, self.maneuver_time_left(vehicle, now)
            self.actions.activate_ahead(
                self.node.name, left, lambda name: estimates.get(name, UNKNOWN_ESTIMATE).seconds
            )

    def control_state(
        self, vehicle: imc.VehicleState | None, now: float, *, compute_progress: bool
    ) -> imc.PlanControlState:
        """The progress, without state, plan and last outcome."""
        left = self.time_left(vehicle, now)
        return imc.PlanControlState(
            plan_eta=int(min(left, 2**31 - 1)) if math.isfinite(left) else UNKNOWN,
            plan_progress=self.update_progress(left) if compute_progress else -1.0,
            man_id=self.node.name if self.node is not None else "",
            man_type=self.node.maneuver.ID if self.node is not None else NO_MANEUVER,
            man_eta=self.maneuver_eta(vehicle),
        )

    def final_statistics(self, plan_id: str, now: float) -> imc.PlanStatistics:
        """Statistics of the finished plan."""
        kind = imc.PlanStatistics.Type.POSTPLAN
        durations = {**self.durations, "Total": now - self.began}
        return imc.PlanStatistics(plan_id=plan_id, type=kind, durations=format_tuple_list(durations, 1))
