"""Distributions: how a value that varies is written in a file, and which value belongs to a share of its runs."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any, NoReturn

import numpy as np

from shoal.campaigns.optional_import import import_optional
from support.diagnostics import LocatedError
from support.located_yaml import Node
from support.terminal_text import with_suggestion

Scalar = float | int | str | bool
_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\d\s.].*)?")
_MOST_STEPS = 100_000
_NORMAL = ("mean", "deviation")


class StudyFileError(LocatedError):
    """A file that does not hold a study; the text names file, line and reason."""


@dataclass(frozen=True)
class Distribution:
    """Distribution of a value.

    `levels` are all its values if these are few, else empty; one with `is_grid` takes each of them in turn, whatever
    the sampling. Values are numbers in `unit` as written in the file, or texts. `text` is as written.
    """

    text: str
    unit: str = ""
    levels: tuple[Scalar, ...] = ()
    is_grid: bool = False
    weights: tuple[float, ...] = ()
    inverse_cdf: Callable[[Any], Any] | None = field(default=None, compare=False, repr=False)

    def quantiles(self, shares: Sequence[float]) -> list[Scalar]:
        """The values below which these shares (0 to 1) of all values are."""
        if self.inverse_cdf is not None:
            return [float(value) for value in self.inverse_cdf(np.asarray(shares, float))]
        if self.weights:
            bounds = np.asarray(list(accumulate(self.weights)))
            places = np.searchsorted(bounds / bounds[-1], np.asarray(shares, float), side="right")
            return [self.levels[min(int(place), len(self.levels) - 1)] for place in places]
        return [self.levels[min(int(share * len(self.levels)), len(self.levels) - 1)] for share in shares]

    def append_unit(self, value: Scalar) -> Scalar:
        """A value as it is written in a scenario: a number with its unit."""
        return f"{value!r} {self.unit}" if self.unit and not isinstance(value, str) else value


def split_value_and_unit(value: float | str) -> tuple[float, str] | None:
    """The number of a value and its unit; None if it is no number."""
    match = _QUANTITY.fullmatch(str(value).strip())
    return (float(match.group(1)), (match.group(2) or "").strip()) if match else None


def is_distribution(node: Node) -> bool:
    """Whether a mapping in a scenario stands for the value that a distribution gives."""
    return isinstance(node.content, dict) and len(node.content) >= 1 and next(iter(node.content)) in KINDS


def parse_distribution(node: Node) -> Distribution:
    """The distribution in `{uniform: [0, 0.5 m/s]}` and the like. Raises the error of the tree, with its line."""
    nodes = node.mapping()
    kind = next(iter(nodes), "")
    if kind not in KINDS:
        node.fail(
            with_suggestion(f"there is no distribution {kind!r}", kind, KINDS) if kind else "expected a distribution"
        )
    if kind != "scipy" and len(nodes) > 1:
        nodes[list(nodes)[1]].fail(f"a distribution has one key, {kind!r}; its numbers belong below it")
    return KINDS[kind](node if kind == "scipy" else nodes[kind], f"{kind}: {_as_written(nodes[kind])}")


def _as_written(node: Node) -> str:
    if isinstance(node.content, dict):
        return "{" + ", ".join(f"{key}: {_as_written(value)}" for key, value in node.content.items()) + "}"
    if isinstance(node.content, list):
        return "[" + ", ".join(map(_as_written, node.content)) + "]"
    return node.content


def _numbers(node: Node, *names: str) -> tuple[list[float], str]:
    """Numbers by name, or in a list in this order, and the unit that they share."""
    if isinstance(node.content, dict):
        nodes = list(node.mapping(*names, required=names).values())
        nodes = [node.content[name] for name in names]
    else:
        nodes = node.items() if isinstance(node.content, list) else [node]
    if len(nodes) != len(names):
        node.fail(f"expected {len(names)} number{'s' * (len(names) != 1)}: {', '.join(names)}")
    return _shared([_quantity(item) for item in nodes], node)


def _quantity(node: Node) -> tuple[float, str]:
    match = _QUANTITY.fullmatch(node.text().strip())
    number = float(match.group(1)) if match else math.nan
    if match is None or not math.isfinite(number):
        node.fail(f"{node.text()!r} is not a number with a unit")
    return number, (match.group(2) or "").strip()


def _shared(found: list[tuple[float, str]], node: Node) -> tuple[list[float], str]:
    units = {unit for number, unit in found if unit or number}  # a plain 0 has any unit
    if len(units) > 1:
        node.fail(f"numbers of one distribution need one unit, not {', '.join(repr(unit) for unit in sorted(units))}")
    return [number for number, _ in found], next(iter(units), "")


def _no_support(node: Node, why: str) -> NoReturn:
    node.fail(f"this distribution has no values: {why}")


def _uniform(node: Node, text: str) -> Distribution:
    (low, high), unit = _numbers(node, "from", "to")
    if not low < high:
        _no_support(node, f"{low:g} is not below {high:g}")
    return Distribution(text, unit, inverse_cdf=lambda share: low + (high - low) * share)


def _log_uniform(node: Node, text: str) -> Distribution:
    (low, high), unit = _numbers(node, "from", "to")
    if not 0.0 < low < high:
        _no_support(node, f"expected 0 < {low:g} < {high:g}")
    return Distribution(text, unit, inverse_cdf=lambda share: low * (high / low) ** share)


def _normal(node: Node, text: str) -> Distribution:
    (mean, deviation), unit = _numbers(node, *_NORMAL)
    _check_deviation(node, deviation)
    ndtri = import_optional("scipy.special").ndtri
    return Distribution(text, unit, inverse_cdf=lambda share: mean + deviation * ndtri(share))


def _truncated(node: Node, text: str) -> Distribution:
    (mean, deviation, low, high), unit = _numbers(node, *_NORMAL, "from", "to")
    _check_deviation(node, deviation)
    if not low < high:
        _no_support(node, f"{low:g} is not below {high:g}")
    frozen = import_optional("scipy.stats").truncnorm(
        (low - mean) / deviation, (high - mean) / deviation, mean, deviation
    )
    return _checked(node, Distribution(text, unit, inverse_cdf=lambda share: np.clip(frozen.ppf(share), low, high)))


def _check_deviation(node: Node, deviation: float) -> None:
    if deviation <= 0.0:
        _no_support(node, f"the deviation {deviation:g} is not above 0")


def _triangular(node: Node, text: str) -> Distribution:
    (low, mode, high), unit = _numbers(node, "from", "mode", "to")
    if not (low <= mode <= high and low < high):
        _no_support(node, f"expected {low:g} <= {mode:g} <= {high:g}")
    frozen = import_optional("scipy.stats").triang((mode - low) / (high - low), low, high - low)
    return _checked(node, Distribution(text, unit, inverse_cdf=frozen.ppf))


def _integer(node: Node, text: str) -> Distribution:
    (low, high), unit = _numbers(node, "from", "to")
    if not (low.is_integer() and high.is_integer()):
        node.fail("expected two integers")
    if low > high:
        _no_support(node, f"{low:g} is above {high:g}")
    if high - low >= _MOST_STEPS:
        node.fail(f"more than {_MOST_STEPS} integers")
    return Distribution(text, unit, tuple(range(int(low), int(high) + 1)))


def _choice(node: Node, text: str) -> Distribution:
    if isinstance(node.content, dict):
        weights = tuple(float(weight.number()) for weight in node.content.values())
        if any(not math.isfinite(weight) or weight < 0.0 for weight in weights) or not math.fsum(weights) > 0.0:
            _no_support(node, "expected weights from 0, at least one above 0")
        keys = [Node(key, weight.file, weight.line, node.error, plain=True) for key, weight in node.content.items()]
        return _listed(keys, text, node, weights)
    return _listed(node.items(), text, node)


def _grid(node: Node, text: str) -> Distribution:
    if not isinstance(node.content, dict):
        return _listed(node.items(), text, node, gridded=True)
    (low, high, steps), unit = _numbers(node, "from", "to", "steps")
    if not (steps.is_integer() and 2 <= steps <= _MOST_STEPS):
        node.fail(f"steps: expected an integer from 2 to {_MOST_STEPS}")
    if low == high:
        _no_support(node, f"{low:g} is not below {high:g}")
    cells = tuple(low + (high - low) * step / (steps - 1) for step in range(int(steps)))
    return Distribution(text, unit, cells, is_grid=True)


def _listed(
    nodes: list[Node], text: str, node: Node, weights: tuple[float, ...] = (), *, gridded: bool = False
) -> Distribution:
    if not nodes:
        _no_support(node, "the list is empty")
    matches = [_QUANTITY.fullmatch(item.text().strip()) for item in nodes]
    numbers: tuple[Scalar, ...] = ()
    unit = ""
    if all(matches) and len({(match.group(2) or "").strip() for match in matches if match}) == 1:
        found, unit = _shared([_quantity(item) for item in nodes], node)
        whole = all(isinstance(item.value(), int) for item in nodes)
        numbers = tuple(int(number) if whole else number for number in found)
    return Distribution(text, unit, numbers or tuple(map(_scalar, nodes)), gridded, weights)


def _scalar(node: Node) -> Scalar:
    node.text()
    value = node.value()
    return value if isinstance(value, bool | int | float | str) else str(node.content)


def _scipy(node: Node, text: str) -> Distribution:
    """Any continuous distribution of SciPy: {scipy: weibull_min, c: 2, scale: 0.3}."""
    nodes = dict(node.mapping())
    name = nodes.pop("scipy")
    stats = import_optional("scipy.stats")
    known = [word for word in dir(stats) if isinstance(getattr(stats, word), stats.rv_continuous)]
    if name.text() not in known:
        name.fail(with_suggestion(f"SciPy has no continuous distribution {name.text()!r}", name.text(), known))
    given = {key: float(value.number()) for key, value in nodes.items()}
    shapes = [word.strip() for word in (getattr(stats, name.text()).shapes or "").split(",") if word.strip()]
    for key in nodes:
        if key not in (*shapes, "loc", "scale"):
            nodes[key].fail(with_suggestion(f"{name.text()} has no parameter {key!r}", key, [*shapes, "loc", "scale"]))
    for shape in shapes:
        if shape not in given:
            name.fail(f"{name.text()} needs {shape}")
    frozen = getattr(stats, name.text())(**given)
    words = ", ".join(f"{key}: {_as_written(value)}" for key, value in node.mapping().items())
    return _checked(node, Distribution(words, inverse_cdf=frozen.ppf))


def _checked(node: Node, made: Distribution) -> Distribution:
    """The distribution, if it has a finite value wherever it is asked."""
    values = made.quantiles([1e-9, 0.5, 1.0 - 1e-9])
    if not all(isinstance(value, float) and math.isfinite(value) for value in values):
        _no_support(node, "SciPy finds none; check its numbers")
    return made


KINDS: dict[str, Callable[[Node, str], Distribution]] = {
    "uniform": _uniform,
    "log uniform": _log_uniform,
    "normal": _normal,
    "truncated": _truncated,
    "triangular": _triangular,
    "integer": _integer,
    "choice": _choice,
    "grid": _grid,
    "scipy": _scipy,
}
