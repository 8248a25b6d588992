"""Flies a plan with a vehicle that is built already, without an operator, and reports the result."""

import math
from collections.abc import Callable
from functools import partial

import imc
from autonomy.plans import forecast_totals
from imc.coordinates import NOWHERE, absolute_position
from runtime.snapshot import InputJournals, run_with_snapshots, save_beside_log
from runtime.vehicle import Vehicle
from shoal.missions.report import COMPLETED, FAILED, ManeuverReport, Report
from shoal.missions.start_request import PlanStartRequest
from support.wgs84 import ground_distance

NEEDED = ("Supervisors.Vehicle", "Plan.Engine")  # a mission waits for their messages
ON_TRACK, AT_DEPTH = 1.5, 0.5  # m; on each path, errors count once they have been smaller
ON_COURSE = math.radians(15.0)
ENTITY_ERRORS = "vehicle errors: "
NEXT_STATES = (imc.PlanControlState.State.READY, imc.PlanControlState.State.BLOCKED)
PathFlags = imc.PathControlState.Flags


class Mission:
    """Starts a plan as soon as the vehicle is ready, follows it, and stops the vehicle when the plan is over.

    `patience` (s) is how long the vehicle may take to be ready. `watch` is called with each PlanControlState,
    `estimated` with the report once it has the estimates. If `over` is given, it is called when the plan is over, and
    the vehicle continues.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        plan: imc.PlanSpecification,
        *,
        calibrate: bool = False,
        patience: float = 120.0,
        watch: Callable[[imc.PlanControlState], object] | None = None,
        over: Callable[[], object] | None = None,
        estimated: Callable[[Report], object] | None = None,
    ):
        self.report: Report = Report()
        self.unsaved: list[OSError] = []
        self._vehicle = vehicle
        flags = imc.PlanControl.Flags.CALIBRATE if calibrate else 0
        request = imc.PlanControl(plan_id=plan.plan_id, flags=flags, arg=plan, dst=vehicle.system, request_id=1)
        self._request = PlanStartRequest(vehicle, request, patience=patience, refused=self._give_up)
        self._watch, self._estimated = watch, estimated
        self._over = vehicle.stop if over is None else over
        self._position: tuple[float, float] | None = None
        self._reference: tuple[float, float] = NOWHERE
        self._errors: dict[str, tuple[int, bool]] = {}
        self._trouble = self._last_error = ""
        self._answer = ""
        self._is_flying = self._has_flown = self._is_over = False
        vehicle.observe(imc.PlanControl, self._judge)
        vehicle.observe(imc.PlanControlState, self._follow)
        vehicle.observe(imc.PathControlState, self._compare)
        vehicle.observe(imc.EstimatedState, self._move)
        vehicle.observe(imc.EntityMonitoringState, self._note_trouble)
        vehicle.observe(imc.PlanStatistics, self._note_estimate)
        vehicle.observe(imc.FuelLevel, self._note_fuel)

    def begin(self) -> None:
        """Start the vehicle, and the plan as soon as it is ready; the caller runs the vehicle."""
        self._vehicle.start()
        self._request.schedule_timeout()

    def fly(self, limit: float, *, snapshot_every: float | None = None) -> Report:
        """Run the vehicle until the plan is over, at most `limit` seconds of its time, and close it.

        A snapshot is saved beside its log every `snapshot_every` seconds; `unsaved` has the errors of those that the
        disk rejects. Raises SnapshotError.
        """
        if snapshot_every is not None:
            InputJournals(self._vehicle)
        self.begin()
        try:
            if snapshot_every is None:
                self._vehicle.run(limit)
            else:
                keep = partial(save_beside_log, self._vehicle)
                self.unsaved = run_with_snapshots(self._vehicle, limit, snapshot_every, keep)
        finally:
            self._vehicle.close()
        return self.report

    def _give_up(self, reason: str) -> None:
        missing = [name for name in NEEDED if not any(task.name == name for task in self._vehicle.tasks)]
        trouble = f"missing {' and '.join(missing)}" if missing else self._trouble
        self._end(FAILED, f"{reason}: {trouble}" if trouble else reason)

    def _judge(self, answer: imc.PlanControl) -> None:
        if self._is_over or answer.src != self._vehicle.system or not self._request.is_answered_by(answer):
            return
        if answer.type == imc.PlanControl.Type.FAILURE:
            self._end(FAILED, self._explain(answer.info))
        elif answer.type == imc.PlanControl.Type.SUCCESS:
            self._answer = answer.info

    def _end(self, outcome: str, reason: str) -> None:
        self._is_over = True
        self.report.outcome, self.report.reason = outcome, reason
        self._over()

    def _follow(self, state: imc.PlanControlState) -> None:
        if state.src != self._vehicle.system:
            return
        legs, names = self.report.legs, imc.PlanControlState.State
        name = names(state.state).name if state.state <= max(names) else str(state.state)
        if self.report.states[-1:] != [name]:
            self.report.states.append(name)
        if legs and self._is_flying:
            legs[-1].seconds = state.timestamp - legs[-1].began
        self._is_flying = state.state == names.EXECUTING
        if self._is_flying:
            self.report.log = self._vehicle.log_folder
        if self._is_flying and (not legs or legs[-1].name != state.man_id):
            legs.append(ManeuverReport(state.man_id, state.timestamp))
        if self._watch is not None:
            self._watch(state)
        if self._request.is_sent and not self._is_over:
            self._look_for_end(state)

    def _look_for_end(self, state: imc.PlanControlState) -> None:
        self.report.reason = "plan not finished"
        self._has_flown |= self._is_flying
        if self._has_flown and state.state in NEXT_STATES:
            done = state.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS
            self._end(COMPLETED if done else FAILED, self._answer if done else "plan was stopped")

    def _compare(self, path: imc.PathControlState) -> None:
        if not self._is_flying or not self.report.legs:
            return
        leg = self.report.legs[-1]
        if not path.flags & (PathFlags.LOITERING | PathFlags.NEAR) and path.lradius == 0.0:
            on_track = abs(path.y) <= ON_TRACK and abs(path.course_error) <= ON_COURSE
            leg.cross_track = self._worst("across", path.path_ref, abs(path.y), on_track, leg.cross_track)
        if not path.flags & PathFlags.NO_Z:
            leg.depth_error = self._worst("depth", path.path_ref, abs(path.z), abs(path.z) <= AT_DEPTH, leg.depth_error)

    def _worst(self, kind: str, path_ref: int, error: float, small: bool, before: float) -> float:
        """The larger of `error` and the worst `before`; `error` counts once it has been small on its path."""
        reference, settled = self._errors.get(kind, (-1, False))
        settled = small or (settled and reference == path_ref)
        self._errors[kind] = path_ref, settled
        if not settled:
            return before
        return error if math.isnan(before) else max(before, error)

    def _move(self, state: imc.EstimatedState) -> None:
        if state.src != self._vehicle.system:
            return
        position = absolute_position(state)[:2]
        before, self._reference = self._reference, (state.lat, state.lon)
        if before == NOWHERE != self._reference:
            self._position = None
        if self._is_flying and self._position is not None and self.report.legs:
            self.report.legs[-1].distance += ground_distance(*self._position, *position)
            self.report.deepest = max(self.report.deepest, state.depth)
        self._position = position

    def _note_trouble(self, state: imc.EntityMonitoringState) -> None:
        names = ", ".join(name for name in (state.cnames, state.enames) if name)
        self._last_error = state.last_error if names else ""
        self._trouble = " - ".join(text for text in (names, state.last_error) if text) if names else ""

    def _explain(self, reason: str) -> str:
        """The reason for which the vehicle stopped a plan, with its last error if the reason only names entities."""
        if not self._last_error or not reason.startswith(ENTITY_ERRORS):
            return reason
        entities = reason.removeprefix(ENTITY_ERRORS)
        is_same = self._last_error.startswith(f"{entities}: ")
        return ENTITY_ERRORS + self._last_error if is_same else f"{reason}; last {self._last_error}"

    def _note_estimate(self, statistics: imc.PlanStatistics) -> None:
        if statistics.src == self._vehicle.system and statistics.type == imc.PlanStatistics.Type.PREPLAN:
            report = self.report
            report.estimated_seconds, report.estimated_energy = forecast_totals(statistics)
            if self._estimated is not None:
                self._estimated(report)

    def _note_fuel(self, fuel: imc.FuelLevel) -> None:
        if fuel.src == self._vehicle.system:
            if not self._is_flying:
                self.report.battery_before = fuel.value
            self.report.battery_after = fuel.value
