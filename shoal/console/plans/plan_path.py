"""The places of a plan, for the map."""

import math
from itertools import chain

import imc
from autonomy.plans import main_sequence, waypoints

Leg = dict[str, object]


def plan_path(plan: imc.PlanSpecification) -> list[Leg]:
    """The maneuvers along the plan's main sequence: name, kind, places (degrees), z (m) with its reference, radius."""
    maneuvers, _ = main_sequence(plan)
    return list(chain.from_iterable(_legs(each) for each in maneuvers))


def _legs(maneuver: imc.PlanManeuver) -> list[Leg]:
    data = maneuver.data
    if data is None:
        return []
    try:
        places = waypoints(data)
    except ValueError:
        places = []
    z, units = getattr(data, "z", None), getattr(data, "z_units", imc.ZUnits.NONE)
    return [
        {
            "name": maneuver.maneuver_id,
            "kind": type(data).__name__,
            "places": [[round(math.degrees(lat), 7), round(math.degrees(lon), 7)] for lat, lon in places],
            "z": z,
            "reference": imc.ZUnits(units).name.lower() if units in set(imc.ZUnits) else str(units),
            "radius": getattr(data, "radius", None),
        }
    ]
