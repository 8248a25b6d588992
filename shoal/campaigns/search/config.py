"""The key `search` of a study: what is sought, among which values, and with how many runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from shoal.campaigns.sampling import Distribution, Scalar, split_value_and_unit
from shoal.campaigns.search.objective import (
    COUNTED,
    DEPRECATED_KEYS,
    MAXIMIZE,
    MINIMIZE,
    SearchObjective,
    parse_objective,
)
from shoal.campaigns.search.search_space import SearchAxis, make_axis
from support.located_yaml import Node
from support.terminal_text import with_suggestion

KEYS = (MINIMIZE, MAXIMIZE, COUNTED, "at a time", "shrink")
AT_A_TIME, MOST_AT_A_TIME = 8, 1000
SHRINK, MOST_SHRINK = 60, 100_000
_SI = ("m", "m/s", "rad", "rpm", "s", "%")  # units of plain numbers


@dataclass(frozen=True)
class SearchConfig:
    """A search among `axes`, by place. All its runs have the `seed` of the scenario.

    Of the runs of the study the first is the scenario as it is, the others are trials, `batch_size` of which follow
    from those before. Up to `max_shrink_runs` more make the change that breaks it smaller. `deprecations` are warnings
    about old keys, with file and line.
    """

    objective: SearchObjective
    axes: Mapping[str, SearchAxis]
    seed: int
    batch_size: int = AT_A_TIME
    max_shrink_runs: int = SHRINK
    deprecations: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Entry of the search in a data set."""
        return {**self.objective.to_dict(), "axes": {place: axis.to_dict() for place, axis in self.axes.items()}}

    @property
    def digest_parts(self) -> list[object]:
        """Inputs that its runs depend on."""
        return [*self.objective.to_dict().values(), self.seed, self.batch_size, self.max_shrink_runs]

    @property
    def sampler_version(self) -> str:
        """Name and version of the library that chooses the trials: another version may choose others."""
        try:
            return f"optuna {version('optuna')}"
        except PackageNotFoundError:
            return "no optuna"


def parse_search(
    node: Node, draft: Any, varied: Mapping[str, Distribution], lines: Mapping[str, Node], fixed: Mapping[str, object]
) -> SearchConfig:
    """The search of a study. `lines` are where the distributions are. Raises the error of the tree, with its line."""
    written = node.mapping()
    for key, item in written.items():
        if key not in KEYS and key not in DEPRECATED_KEYS:
            item.fail(with_suggestion(f"search: unknown key {key!r}", key, KEYS))
    old = {key: DEPRECATED_KEYS[key] for key in written if key in DEPRECATED_KEYS}
    if both := [key for key, new in old.items() if new in written]:
        written[both[0]].fail(f"search: {both[0]} and {old[both[0]]} are the same: write {old[both[0]]} only")
    nodes = {old.get(key, key): item for key, item in written.items()}
    scenario = draft.scenario(fixed)
    goal = parse_objective(node, nodes, scenario)
    if not varied:
        node.fail("a search needs something to vary: there is no distribution")
    if "shrink" in nodes and not goal.seeks_failure:
        nodes["shrink"].fail("shrink has no effect: only a search for the smallest margin finds a failure to shrink")
    axes: dict[str, SearchAxis] = {}
    for place, found in varied.items():
        if found.is_grid:
            lines[place].fail(f"{place}: a search chooses values itself: write choice or uniform instead of grid")
        try:
            axes[place] = make_axis(place, found, _default(draft, fixed, place, found))
        except ValueError as error:
            lines[place].fail(f"{place}: {error}")
    at_a_time = _count(nodes, "at a time", 1, MOST_AT_A_TIME, AT_A_TIME)
    shrink = _count(nodes, "shrink", 0, MOST_SHRINK, SHRINK)
    notes = tuple(f"{written[key].where}: search: {key} is deprecated: write {new}" for key, new in old.items())
    return SearchConfig(goal, axes, scenario.seed, at_a_time, shrink, notes)


def _count(nodes: Mapping[str, Node], key: str, least: int, most: int, default: int) -> int:
    if key not in nodes:
        return default
    found = nodes[key].integer()
    if not least <= found <= most:
        nodes[key].fail(f"{key}: expected {least} to {most}, not {found}")
    return found


def _default(draft: Any, fixed: Mapping[str, object], place: str, found: Distribution) -> Scalar | None:
    """The value of a scenario as a number in the unit of a distribution; None if it is in another unit."""
    value = draft.current_value(place)
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return value if isinstance(value, bool) else None
    number = split_value_and_unit(value)
    if number is None:
        return str(value) if value in found.levels else None
    size, unit = number
    if unit == found.unit or not size:
        return size
    if (unit and found.unit) or not _is_in(unit or found.unit, place):
        return None
    own, other = (_settings(draft, {**fixed, place: given}) for given in (value, found.append_unit(size)))
    return size if own == other else None


def _is_in(unit: str, place: str) -> bool:
    """Whether a plain number at a place may be in a unit; this follows from the settings of the vehicle."""
    return "/parameters/" in place or (unit in _SI and "/set/" not in place)


def _settings(draft: Any, values: Mapping[str, object]) -> list[tuple[str, str, object]]:
    """The options that a scenario with some values sets; a number counts however it is written."""
    vehicles = draft.scenario(values).vehicles
    settings = ((spec.name, setting) for spec in vehicles for setting in spec.settings)
    return [(name, f"{s.section}:{s.option}", split_value_and_unit(s.value) or s.value) for name, s in settings]
