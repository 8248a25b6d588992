"""Reads one field of a message over time, by entity, for a plot of a report."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

import imc
from runtime.logs import LogSummary
from shoal.logs.inspect.time_plot import Curve
from support.terminal_text import quoted, suggestion

BATTERY = "FuelLevel.value"
COLORS = ("a", "b", "c", "d", "e", "f")  # classes of the style sheet; more entities are not drawn
_DEGREES = {"rad": "°", "rad/s": "°/s"}


class FieldPlot(NamedTuple):
    """A plot: its title, with the unit, and a curve for each entity; times in s since the log's start."""

    title: str
    curves: list[Curve]


def read_field_plots(log: imc.Log, summary: LogSummary, fields: Sequence[str]) -> list[FieldPlot]:
    """The plots of "Message.field" or "Message.field:Entity Label", as published by the log's owner.

    The battery is added if the log has it. Angles are in degrees. Raises ValueError for a field that the log's
    definitions, or an entity that the messages do not have, with the nearest name.
    """
    has_battery = BATTERY.partition(".")[0] in summary.by_type
    wanted = [*fields, *([BATTERY] if has_battery and BATTERY not in fields else [])]
    return [_read_plot(log, summary, text) for text in wanted]


def join_plots(runs: Iterable[tuple[str, Sequence[FieldPlot]]]) -> list[FieldPlot]:
    """The plots of several runs with equal titles in one, each curve named after its run."""
    joined: dict[str, list[Curve]] = {}
    for name, plots in runs:
        for title, curves in plots:
            joined.setdefault(title, []).extend(curve._replace(name=f"{name} {curve.name}".strip()) for curve in curves)
    return [_colored(title, curves, "curves") for title, curves in joined.items()]


def _read_plot(log: imc.Log, summary: LogSummary, text: str) -> FieldPlot:
    name, field, label = _parse(log.schema, text)
    rows = log.array(name)
    rows = rows[rows["src"] == summary.owner]
    if len(rows) == 0:
        raise ValueError(f"{text}: there is no {name} of this vehicle in the log{_near(name, summary.by_type)}")
    labels = {
        int(number): summary.names.entity_label(summary.owner, int(number)) for number in np.unique(rows["src_ent"])
    }
    if label and label not in labels.values():
        raise ValueError(f"{text}: no {name} is from {quoted(label)}{_near(label, labels.values())}")
    unit = _DEGREES.get(field.unit, field.unit)
    curves: list[Curve] = []
    for number, title in labels.items():
        if label in ("", title):
            mine = rows[rows["src_ent"] == number]
            mine = mine[np.argsort(mine["timestamp"], kind="stable")]
            values = mine[field.attribute].astype(float)
            values = np.degrees(values) if field.unit in _DEGREES else values
            curves.append(Curve(title, "a", mine["timestamp"] - summary.start, values, unit, _digits(values)))
    return _colored(f"{name}.{field.abbrev}{', ' + unit if unit else ''}", curves, "entities")


def _colored(title: str, curves: Sequence[Curve], what: str) -> FieldPlot:
    """A plot of the first curves, each with a color of its own; the title gives their number and that of all curves."""
    shown = [curve._replace(color=color) for curve, color in zip(curves, COLORS, strict=False)]
    return FieldPlot(title + (f" ({len(shown)} of {len(curves)} {what})" if len(curves) > len(shown) else ""), shown)


def _parse(schema: imc.Schema, text: str) -> tuple[str, imc.Field, str]:
    """Message, field and label of "Message.field:Label"."""
    path, _, label = text.partition(":")
    name, dot, field_name = path.strip().partition(".")
    if not dot:
        raise ValueError(f"{text}: expected Message.field, such as {BATTERY}, or Message.field:Entity Label")
    if name not in schema.types:
        raise ValueError(f"{text}: there is no message {quoted(name)}{_near(name, schema.types)}")
    fields = {field.abbrev: field for field in schema.types[name].fields}
    fields |= {field.attribute: field for field in schema.types[name].fields}
    field = fields.get(field_name)
    if field is None:
        raise ValueError(f"{text}: {name} has no field {quoted(field_name)}{_near(field_name, fields)}")
    if not field.type.startswith(("fp", "int", "uint")):
        raise ValueError(f"{text}: {name}.{field_name} is not a number, but {field.type}")
    return name, field, label.strip()


def _near(name: str, known: Iterable[str]) -> str:
    hint = suggestion(name, known)
    return f"; {hint}" if hint else ""


def _digits(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> int:
    """Number of decimals that resolve about a thousandth of the range."""
    known = values[np.isfinite(values)]
    span = float(np.ptp(known)) if len(known) else 0.0
    return min(max(3 - math.floor(math.log10(span)) - 1, 0), 7) if span > 0.0 else 1
