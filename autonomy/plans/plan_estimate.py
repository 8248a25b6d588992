"""A vehicle's estimate of the time and energy that a plan takes, beside the charge of its battery."""

import math
from dataclasses import dataclass

import imc
from autonomy.plans.duration_energy_forecast import forecast_totals


@dataclass(frozen=True)
class PlanEstimate:
    """The vehicle's estimate of a plan: `seconds`, `energy` in % of a full battery; NaN if unknown.

    `battery` is the charge before the plan, in %; NaN if unknown. `rejected` is the reason for which the vehicle would
    not start the plan now, empty if it would, or if that is unknown.
    """

    seconds: float = math.nan
    energy: float = math.nan
    battery: float = math.nan
    rejected: str = ""

    @classmethod
    def from_statistics(cls, statistics: imc.Message | None, fuel: imc.FuelLevel | None) -> "PlanEstimate":
        """The estimate in a reply of the plan engine, and the last report of the battery."""
        battery = math.nan if fuel is None else fuel.value
        if not isinstance(statistics, imc.PlanStatistics):
            return cls(battery=battery)
        return cls(*forecast_totals(statistics), battery)

    def describe(self) -> str:
        """The estimate on one line."""
        seconds = f"{self.seconds:.0f} s" if math.isfinite(self.seconds) else "unknown"
        energy, battery = format_percent(self.energy), format_percent(self.battery)
        if math.isnan(self.seconds) and math.isnan(self.energy):
            return f"time and energy unknown, charge of the battery {battery}"
        if math.isnan(self.energy + self.battery):
            return f"estimated time {seconds}, energy {energy}, charge of the battery {battery}"
        return f"estimated time {seconds}, energy {energy} of the battery, which has {battery}"


def format_percent(value: float) -> str:
    """A share in %, "unknown" if it is NaN."""
    return "unknown" if math.isnan(value) else f"{value:.1f} %"
