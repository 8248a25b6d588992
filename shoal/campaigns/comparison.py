"""Compares two campaigns run by run: what a change has made better and worse."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

from shoal.campaigns.jobs import ResultRow, is_finished
from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.pass_rate import PassRate, has_interval
from shoal.campaigns.results import CampaignResults
from shoal.logs.inspect import format_noun_count
from support.terminal_text import with_suggestion

PASS_RATE = "pass rate"
_LIMIT = re.compile(r"(interval of )?(.+?)\s*(<=|>=|<|>)\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(%?)")
_COMPARED = ("metrics.", "margins.")


class NotComparable(ValueError):
    """Two data sets whose runs are not pairs, or a limit on something that they do not have."""


@dataclass(frozen=True)
class ColumnChange:
    """Difference of a column of B from that of A in `runs` pairs: the mean of B - A, and the interval of this mean.

    Both ends of the interval are NaN if the sampling gives none.
    """

    name: str
    runs: int
    before: float
    after: float
    mean: float
    low: float
    high: float
    fell: int
    rose: int

    @property
    def has_interval(self) -> bool:
        return math.isfinite(self.high - self.low)

    @property
    def is_significant(self) -> bool:
        """Whether the interval excludes 0."""
        return self.low > 0.0 or self.high < 0.0


@dataclass(frozen=True)
class RunPair:
    """One run of both: rows of A and B."""

    a: ResultRow
    b: ResultRow

    @property
    def margin_loss(self) -> float:
        """Margin that B has lost; NaN if there is none to compare."""
        fall = float(self.a["margin"]) - float(self.b["margin"])
        return fall if math.isfinite(fall) else math.nan


@dataclass(frozen=True)
class CampaignComparison:
    """The pairs of two campaigns. `only_a` and `only_b` count runs without a partner, `unfinished` pairs of which
    one run did not end, so that nothing is known of it.

    `p_value` is that of McNemar's exact test: how probable as many or more runs of one side among those whose verdict
    changed are if the change has no effect; NaN if the runs are not independent.
    """

    rate_a: PassRate
    rate_b: PassRate
    rate_change: ColumnChange
    p_value: float
    changes: tuple[ColumnChange, ...]
    broken: tuple[RunPair, ...]
    repaired: tuple[RunPair, ...]
    worse: tuple[RunPair, ...]
    only_a: int
    only_b: int
    unfinished: int

    def describe_exceeded_limit(self, limit: str) -> str:
        """A sentence if a limit such as "pass rate < -2 %" or "interval of metrics.drift > 5 %" is met, else empty.

        It is a limit of the mean difference B - A, or of its whole interval, which chance seldom exceeds; in percentage
        points of a pass rate, in percent of A otherwise. Raises NotComparable for a limit that cannot be read, and if
        there is no interval.
        """
        match = _LIMIT.fullmatch(limit.strip())
        if match is None:
            raise NotComparable(
                f"{limit!r} is not a limit; write 'pass rate < -2 %' or 'interval of metrics.NAME > 0.5'"
            )
        of_interval, name, sign, number, percent = match.groups()
        changes = {change.name: change for change in (self.rate_change, *self.changes)}
        if name not in changes:
            raise NotComparable(with_suggestion(f"neither data set has {name!r}", name, changes))
        change, bound = changes[name], float(number)
        if percent:
            bound *= 0.01 if name == PASS_RATE else 0.01 * abs(change.before)
        if not math.isfinite(change.mean):
            return f"{name} cannot be compared: no pair of runs has it"
        if of_interval and not change.has_interval:
            raise NotComparable(f"{limit!r}: {name} has no interval, {self.explain_missing_interval(change)}")
        nearest = change.mean if not of_interval else change.high if "<" in sign else change.low
        is_beyond = {"<": nearest < bound, ">": nearest > bound, "<=": nearest <= bound, ">=": nearest >= bound}
        if not is_beyond[sign]:
            return ""
        interval = f" ({change.low:+.4g} to {change.high:+.4g})" if change.has_interval else ""
        return f"{name} changed by {change.mean:+.4g}{interval}: {limit}"

    def explain_missing_interval(self, change: ColumnChange) -> str:
        """Reason why a change has none."""
        if has_interval(self.rate_a.sampling):
            return f"since {format_noun_count(change.runs, 'pair')} cannot give one"
        return f"since the runs of sampling {self.rate_a.sampling} are not independent"


def compare_campaigns(a: CampaignResults, b: CampaignResults, *, confidence: float = 0.95) -> CampaignComparison:
    """Compare runs of the same number. Raises NotComparable if seeds or values of these differ, and for searches."""
    for data in (a, b):
        if "search" in data.metadata:
            words = "its runs went where the search led them, so they are no pairs and have no pass rate"
            raise NotComparable(f"{data.folder} is of a search: {words}; compare campaigns without one")
    rows_a, rows_b = ({row["run"]: row for row in data.counted_rows} for data in (a, b))
    common = [RunPair(rows_a[run], rows_b[run]) for run in sorted(rows_a.keys() & rows_b.keys())]
    pairs = [pair for pair in common if is_finished(pair.a) and is_finished(pair.b)]
    if not pairs:
        raise NotComparable(f"{a.folder} and {b.folder} have no run in common" + " that ended in both" * bool(common))
    for pair in pairs:
        _check_pair(a, b, pair)
    broken = [pair for pair in pairs if pair.a["passed"] and not pair.b["passed"]]
    repaired = [pair for pair in pairs if pair.b["passed"] and not pair.a["passed"]]
    worse = [pair for pair in pairs if pair.margin_loss > 0.0]
    names = dict.fromkeys(name for pair in pairs for name in pair.a if name.startswith(_COMPARED) and name in pair.b)
    sampling = str(a.metadata["sampling"])
    is_independent = has_interval(sampling)
    rate_change = _rate_change(pairs, len(broken), len(repaired), confidence)
    found = [change for name in sorted(names) if (change := _change(name, pairs, confidence)).runs]
    if not is_independent:
        rate_change, *found = (replace(change, low=math.nan, high=math.nan) for change in (rate_change, *found))
    passed_a = len([pair for pair in pairs if pair.a["passed"]])
    passed_b = len([pair for pair in pairs if pair.b["passed"]])
    return CampaignComparison(
        PassRate(passed_a, len(pairs), confidence, sampling=sampling),
        PassRate(passed_b, len(pairs), confidence, sampling=sampling),
        rate_change,
        mcnemar_p_value(len(broken), len(repaired)) if is_independent else math.nan,
        tuple(sorted(found, key=_severity)),
        tuple(_worst_first(broken)),
        tuple(sorted(repaired, key=lambda pair: pair.a["run"])),
        tuple(_worst_first(worse)),
        len(rows_a) - len(common),
        len(rows_b) - len(common),
        len(common) - len(pairs),
    )


def mcnemar_p_value(broken: int, repaired: int) -> float:
    """The exact, two-sided p-value of McNemar's test."""
    total, few = broken + repaired, min(broken, repaired)
    if not total:
        return 1.0
    tail = math.fsum(math.comb(total, k) / 2**total for k in range(few + 1))
    return min(1.0, 2.0 * tail)


def _check_pair(a: CampaignResults, b: CampaignResults, pair: RunPair) -> None:
    run = pair.a["run"]
    if pair.a["seed"] != pair.b["seed"]:
        raise NotComparable(f"run {run} of {a.folder} and of {b.folder} have different seeds")
    for name, value in pair.a.items():
        if name.startswith("values.") and name in pair.b and pair.b[name] != value:
            path = name.partition(".")[2]
            words = f"run {run} of {a.folder} and of {b.folder} were drawn differently"
            raise NotComparable(f"{words}: {path} is {value} and {pair.b[name]}")


def _rate_change(pairs: Sequence[RunPair], broken: int, repaired: int, confidence: float) -> ColumnChange:
    """The difference of two pass rates in pairs, with the interval of A. Agresti and Y. Min (2005)."""
    count = len(pairs)
    z = NormalDist().inv_cdf(0.5 + 0.5 * confidence)
    middle = (repaired - broken) / (count + 2)
    spread = math.sqrt(max(repaired + broken + 1.0 - (repaired - broken) ** 2 / (count + 2), 0.0)) * z / (count + 2)
    before = len([pair for pair in pairs if pair.a["passed"]]) / count
    after = len([pair for pair in pairs if pair.b["passed"]]) / count
    low, high = max(middle - spread, -1.0), min(middle + spread, 1.0)
    return ColumnChange(PASS_RATE, count, before, after, (repaired - broken) / count, low, high, broken, repaired)


def _change(name: str, pairs: Sequence[RunPair], confidence: float) -> ColumnChange:
    """The mean difference with Student's interval, over the pairs in which both are finite."""
    pairs_of = [(float(pair.a.get(name, math.nan)), float(pair.b.get(name, math.nan))) for pair in pairs]
    both = [(a, b) for a, b in pairs_of if math.isfinite(a) and math.isfinite(b)]
    count = len(both)
    if not count:
        return ColumnChange(name, 0, math.nan, math.nan, math.nan, math.nan, math.nan, 0, 0)
    steps = [b - a for a, b in both]
    mean, half = math.fsum(steps) / count, math.inf
    if count > 1:
        quantile = float(import_optional("scipy.stats").t.ppf(0.5 + 0.5 * confidence, count - 1))
        half = quantile * math.sqrt(math.fsum((step - mean) ** 2 for step in steps) / (count - 1) / count)
    fell, rose = len([step for step in steps if step < 0.0]), len([step for step in steps if step > 0.0])
    before, after = math.fsum(a for a, _ in both) / count, math.fsum(b for _, b in both) / count
    return ColumnChange(name, count, before, after, mean, mean - half, mean + half, fell, rose)


def _severity(change: ColumnChange) -> tuple[bool, bool, float]:
    """Margins that fell for sure first, then what changed most beside its interval."""
    half = 0.5 * (change.high - change.low) if change.has_interval else math.inf
    size = -abs(change.mean) / half if half else -math.inf if change.mean else 0.0
    return not (change.name.startswith("margins.") and change.high < 0.0), not change.is_significant, size


def _worst_first(pairs: Iterable[RunPair]) -> list[RunPair]:
    return sorted(
        pairs,
        key=lambda pair: (
            math.isnan(pair.margin_loss),
            -pair.margin_loss if pair.margin_loss == pair.margin_loss else 0.0,
        ),
    )
