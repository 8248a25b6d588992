"""Objective of a search: the largest or smallest value of a margin or a metric."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shoal.campaigns.jobs import ResultRow
from support.located_yaml import Node
from support.terminal_text import with_suggestion

MINIMIZE, MAXIMIZE = "minimize", "maximize"
DEPRECATED_KEYS = {"minimise": MINIMIZE, "maximise": MAXIMIZE}
COUNTED, ALL, PASSED = "of", "all", "passed"
MARGIN, OF = "margin", "margin of "


@dataclass(frozen=True)
class SearchObjective:
    """A column of the rows, and whether its largest value is sought. `text` is as written in the study.

    With `only_passed`, runs that fail do not count: a vehicle that gives up may be very near to its track.
    """

    text: str
    column: str
    is_maximized: bool
    only_passed: bool

    @property
    def extreme_word(self) -> str:
        return "largest" if self.is_maximized else "smallest"

    @property
    def seeks_failure(self) -> bool:
        """Whether the search is for what makes an expectation fail."""
        return not self.is_maximized and (self.column == MARGIN or self.column.startswith("margins."))

    def value(self, row: ResultRow) -> float:
        """The value of a run; NaN if it has none that counts. A task that raises fails all expectations together."""
        found = row.get(self.column, math.nan)
        if row["error"]:
            return -math.inf if self.column == MARGIN and found == found else math.nan
        return float(found) if row["passed"] or not self.only_passed else math.nan

    def is_better(self, value: float, other: float) -> bool:
        """Whether a value is nearer to what is sought than another one, which may be NaN."""
        if value != value:
            return False
        return other != other or (value > other if self.is_maximized else value < other)

    def is_failure(self, row: ResultRow) -> bool:
        """Whether the run shows what a search for a failure looks for."""
        return self.seeks_failure and self.value(row) <= 0.0

    def to_dict(self) -> dict[str, Any]:
        """Entry of the objective in a data set."""
        words = {"goal": self.text, "column": self.column}
        return {**words, "largest": self.is_maximized, "only passed": self.only_passed}


def objective_from_dict(about: Mapping[str, Any]) -> SearchObjective:
    """The goal that `about` describes."""
    return SearchObjective(about["goal"], about["column"], about["largest"], about["only passed"])


def parse_objective(node: Node, nodes: Mapping[str, Node], scenario: Any) -> SearchObjective:
    """The goal in `{minimize: margin of NAME}` and the like. Raises the error of the tree, with its line."""
    ways = [key for key in (MINIMIZE, MAXIMIZE) if key in nodes]
    if len(ways) != 1:
        node.fail(f"a search has either {MINIMIZE} or {MAXIMIZE}: {MARGIN}, {OF}NAME, or metrics.NAME")
    item = nodes[ways[0]]
    margins = {_tidy(f"{OF}{found.name}"): f"margins.{found.name}" for found in scenario.expectations}
    metrics = {_tidy(f"metrics.{found.name}"): f"metrics.{found.name}" for found in scenario.metrics}
    columns = {MARGIN: MARGIN, **margins, **metrics}
    text = _tidy(item.text())
    if text not in columns:
        kind = "expectation" if text.startswith(OF) else "metric" if text.startswith("metrics.") else "margin or metric"
        item.fail(with_suggestion(f"the scenario has no {kind} {text.removeprefix(OF)!r}", text, columns))
    if text == MARGIN and not margins:
        item.fail("the scenario expects nothing, so it has no margin")
    only_passed = text in metrics
    if COUNTED in nodes:
        if (found := nodes[COUNTED].text().strip()) not in (ALL, PASSED):
            nodes[COUNTED].fail(
                with_suggestion(f"{COUNTED}: expected {ALL} or {PASSED}, not {found!r}", found, (ALL, PASSED))
            )
        only_passed = found == PASSED
    if only_passed and text not in metrics and ways[0] == MINIMIZE:
        nodes[COUNTED].fail("a run that passes has no margin that fails: leave this out")
    return SearchObjective(text, columns[text], ways[0] == MAXIMIZE, only_passed)


def _tidy(text: str) -> str:
    return " ".join(text.split())
