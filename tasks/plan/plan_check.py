"""The check that a plan has to pass before a vehicle starts it."""

from collections.abc import Collection
from dataclasses import dataclass

import imc
from autonomy.plans import PlanError, PlanForecast, Preflight, is_airborne
from runtime import Task
from tasks.plan.actions import unsupported_setting_reasons
from tasks.plan.outgoing_requests import MessageCache


@dataclass(frozen=True)
class PlanCheck:
    """Rejects plans for their `preflight`, the battery and entities that the vehicle lacks.

    `reserve` is the battery level (%) below which none starts; with `predicts_fuel` a plan that needs more than what is
    above it is rejected, too. With `needs_entities` one with parameters for entities that the vehicle lacks is
    rejected, else they are a warning of `task`.
    """

    task: Task
    preflight: Preflight
    reserve: float
    predicts_fuel: bool
    needs_entities: bool

    def forecast(
        self, plan: imc.PlanSpecification, supported: Collection[int], situation: MessageCache
    ) -> PlanForecast:
        """The forecast of a plan with maneuvers that are `supported` (ids), now. Raises PlanError if it is rejected."""
        state, limits = situation.of(imc.EstimatedState), situation.of(imc.OperationalLimits)
        fuel, medium = situation.of(imc.FuelLevel), situation.of(imc.VehicleMedium)
        if fuel is not None and fuel.value < self.reserve:
            raise PlanError(self.reserve_text)
        level = fuel.value - self.reserve if fuel is not None and self.predicts_fuel else None
        found = self.preflight.check(plan, supported, state, level, self.task.now, limits, is_airborne(medium))
        for reason in unsupported_setting_reasons(found.graph, self.task.vehicle):
            if self.needs_entities:
                raise PlanError(reason)
            self.task.log.warning(reason)
        return found

    @property
    def reserve_text(self) -> str:
        """The reason for which no plan is carried out with less than the reserve."""
        return f"the battery is below its reserve of {self.reserve:g} %"
