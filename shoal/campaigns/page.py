"""Draws a campaign as one HTML page that needs no other file and no network."""

import math
import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from runtime.problem import printable
from shoal.campaigns.analysis import (
    Columns,
    Index,
    by_chance,
    choices_of,
    inputs_of,
    outputs_of,
    parted,
    rank_correlations,
    sobol_indices,
)
from shoal.campaigns.dataset import DataSet, DataSetError
from shoal.campaigns.plots import MOST_PLOTS, histograms, pass_rates, scatters, track_map
from shoal.campaigns.rates import Rate
from shoal.campaigns.rows import Row

WORST = 20
MOST_INDICES = 12  # outputs
SCATTERS = 6
MEDIANS = 4  # outputs beside each choice
STRONG = 0.1  # a coefficient below is not worth a picture
LONGEST_TEXT = 300
_HERE = Path(__file__).parent


def campaign_page(data: DataSet, beside: Path) -> str:
    """The page of a data set, for a file in the folder `beside`: links to logs are relative to it.

    Text from the data set is escaped. Raises DataSetError if it has no run.
    """
    rows = data.counted
    if not rows:
        raise DataSetError(f"{data.folder} has no run yet")
    passed = np.array([bool(row["passed"]) for row in rows])
    inputs, outputs = inputs_of(rows), outputs_of(rows)
    units = data.about["units"]
    rate = data.rate
    correlations = rank_correlations(inputs, outputs)
    indices = sobol_indices(data, rows, dict(list(outputs.items())[:MOST_INDICES]))
    strongest = _strongest(correlations, indices)
    parts = [
        _tiles(data, rows, rate),
        _section("Expectations", _expectations(rows, rate.confidence)),
        _section("Pass rate over what varies, %", pass_rates(inputs, passed, units, rate.confidence)),
        _section("Choices", _choices(rows, outputs, rate.confidence), _CHOICES),
        _section("Metrics and margins", histograms(outputs, passed, units), _LEGEND + _only_first(outputs)),
        _section("Rank correlation", _correlations(inputs, outputs, correlations), _CORRELATION),
        _section("Sobol indices", _indices(indices), _SOBOL),
        _section("Strongest relations", scatters(strongest, inputs, outputs, passed, units), _LEGEND),
        _section("Tracks", track_map(rows), _LEGEND + " Green points are starts."),
        _section(f"The {min(WORST, len(rows))} worst runs", _worst(data, rows, beside)),
        _section("Runs that ended out of order", _errors(rows)),
    ]
    style = (_HERE / "page.css").read_text(encoding="utf-8")
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'"
    about = data.about
    text = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_safe(data.name)}</title><style>{style}</style></head>
<body><main><header><h1>{_safe(data.name)}</h1><p>{_safe(about["description"])}</p>
<p>{_safe(about["file"])} · seed {_safe(about["seed"])} · sampling {_safe(about["sampling"])}</p></header>
{"".join(parts)}
<footer>Made with {_safe(about["versions"])}.</footer></main></body></html>
"""
    return text.encode("utf-8", "replace").decode("utf-8")


_LEGEND = "Blue: passed. Red: failed."
_CHOICES = "Runs by what they drew, and the medians of the outputs that differ most between them."
_CORRELATION = "Spearman's coefficient: 1 if the output rises with the input, -1 if it falls. Gray may be chance."
_SOBOL = (
    "The share of an output's variance that an input has, by SALib: first, alone; total, with all that it acts "
    "together with. ± is half the interval of 95 %."
)


def _only_first(outputs: Columns) -> str:
    return f" The first {MOST_PLOTS} of {len(outputs)}." if len(outputs) > MOST_PLOTS else ""


def _tiles(data: DataSet, rows: Sequence[Row], rate: Rate) -> str:
    low, high = rate.interval
    errors = len([row for row in rows if row["error"]])
    simulated, cpu = (math.fsum(row[name] for row in rows) for name in ("seconds", "cpu"))
    tiles = [
        ("bad" if rate.share < 0.5 else "", f"{rate.share:.1%}", "of runs passed"),
        ("", f"{low:.1%} to {high:.1%}", f"true pass rate, {100 * rate.confidence:g}% confidence (Wilson)"),
        ("", f"{rate.passed} of {rate.runs}", "runs passed"),
        ("bad" if errors else "", str(errors), "ended out of order"),
        ("", f"{simulated / 3600.0:.1f} h", "simulated"),
        ("", f"{cpu / 3600.0:.2f} h", "of CPU"),
        ("", f"{len(rows) * 3600.0 / cpu:.0f}" if cpu else "", "runs per hour of CPU"),
    ]
    if data.end is None:
        tiles.append(("fair", "not over", "campaign"))
    return '<div class="tiles">' + "".join(
        f'<div class="tile {kind}"><b>{_safe(value)}</b><span>{_safe(what)}</span></div>' for kind, value, what in tiles
    ) + "</div>"  # fmt: skip


def _expectations(rows: Sequence[Row], confidence: float) -> str:
    names = dict.fromkeys(name.partition(".")[2] for row in rows for name in row if name.startswith("verdicts."))
    lines: list[Sequence[str]] = []
    for name in sorted(names):
        judged = [row for row in rows if f"verdicts.{name}" in row]
        rate = Rate(len([row for row in judged if row[f"verdicts.{name}"]]), len(judged), confidence)
        margins: Any = np.array([row[f"margins.{name}"] for row in judged], float)
        margins = margins[np.isfinite(margins)]
        least, median = (f"{f(margins):.4g}" if len(margins) else "" for f in (np.min, np.median))
        idle = len([row for row in judged if not row.get(f"applied.{name}", True)])
        low, high = rate.interval
        lines.append((name, f"{rate.share:.1%}", f"{low:.1%} to {high:.1%}", least, median, str(idle or "")))
    heads = ("expectation", "passed", "interval", "least margin", "median margin", "never applied")
    return _table(heads, lines, numbers=range(1, 6)) if lines else ""


def _choices(rows: Sequence[Row], outputs: Columns, confidence: float) -> str:
    tables: list[str] = []
    for name, groups in choices_of(rows).items():
        shares = {output: parted(list(groups.values()), column) for output, column in outputs.items()}
        told = sorted((o for o in shares if shares[o] > STRONG), key=lambda output: -shares[output])[:MEDIANS]
        lines: list[Sequence[str]] = []
        for word, group in groups.items():
            rate = Rate(len([k for k in group if rows[k]["passed"]]), len(group), confidence)
            low, high = rate.interval
            medians = [_median(outputs[output][group]) for output in told]
            lines.append((word, str(rate.runs), f"{rate.share:.1%}", f"{low:.1%} to {high:.1%}", *medians))
        heads = (name.partition(".")[2], "runs", "passed", "interval", *told)
        tables.append(_table(heads, lines, numbers=range(1, len(heads))))
    return "".join(tables)


def _median(column: Any) -> str:
    finite = column[np.isfinite(column)]
    return f"{np.median(finite):.4g}" if len(finite) else ""


def _correlations(inputs: Columns, outputs: Columns, found: dict[tuple[str, str], tuple[float, int]]) -> str:
    if not found:
        return ""
    rows: list[str] = []
    for output in outputs:
        cells: list[str] = []
        for name in inputs:
            r, count = found.get((name, output), (math.nan, 0))
            if math.isnan(r):
                cells.append("<td></td>")
                continue
            kind = "n soft" if abs(r) < by_chance(count) else "n"
            color = f"rgba({'198,47,54' if r < 0 else '23,105,194'},{min(abs(r), 1.0) * 0.7:.2f})"
            cells.append(f'<td class="{kind}" style="background:{color}">{r:+.2f}</td>')
        rows.append(f"<tr><td>{_safe(output)}</td>{''.join(cells)}</tr>")
    heads = "".join(f'<th class="n">{_safe(name.partition(".")[2])}</th>' for name in inputs)
    return f'<div class="scroll"><table><tr><th></th>{heads}</tr>{"".join(rows)}</table></div>'


def _indices(found: dict[tuple[str, str], Index]) -> str:
    lines: list[Sequence[str]] = []
    for (name, output), index in sorted(found.items(), key=lambda item: (item[0][1], -item[1].first)):
        total = "" if math.isnan(index.total) else f"{index.total:.2f} ± {index.total_half:.2f}"
        lines.append((output, name.partition(".")[2], f"{index.first:.2f} ± {index.first_half:.2f}", total))
    return _table(("output", "input", "first", "total"), lines, numbers=(2, 3)) if lines else ""


def _strongest(
    found: dict[tuple[str, str], tuple[float, int]], indices: dict[tuple[str, str], Index]
) -> list[tuple[str, str]]:
    """Pairs of an input and an output that are related, also where an output rises on both sides of the middle."""
    strengths = {pair: abs(r) for pair, (r, count) in found.items() if abs(r) > max(STRONG, by_chance(count))}
    for pair, index in indices.items():
        if index.first > max(STRONG, 2.0 * index.first_half):
            strengths[pair] = max(strengths.get(pair, 0.0), math.sqrt(index.first))
    return sorted(strengths, key=lambda pair: -strengths[pair])[:SCATTERS]


def _worst(data: DataSet, rows: Sequence[Row], beside: Path) -> str:
    worst = sorted(rows, key=lambda row: (not row["error"], row["passed"], row["margin"], row["run"]))[:WORST]
    lines: list[Sequence[str]] = []
    for row in worst:
        drawn = [f"{name.partition('.')[2]} = {_short(row[name])}" for name in row if name.startswith("values.")]
        links = [_link(data.folder / row[name], name.partition(".")[2], beside) for name in row if _is_log(name)]
        why = row["error"].strip().splitlines()[-1] if row["error"] else row["reason"]
        again = f"shoal campaign rerun {shlex.quote(str(data.folder))} --run {row['run']}"
        code = f"<code>{_safe(again)}</code>"
        cells = (str(row["run"]), f"{row['margin']:.4g}", _safe(why), _safe(", ".join(drawn)), ", ".join(links) or code)
        lines.append(cells)
    return _table(("run", "margin", "why", "drawn", "log, or how to get it"), lines, numbers=(0, 1), safe=True)


def _is_log(name: str) -> bool:
    return name.startswith("logs.")


def _link(folder: Path, words: str, beside: Path) -> str:
    place, base = folder.resolve(), beside.resolve()
    target = place.relative_to(base).as_posix() if place.is_relative_to(base) else place.as_uri()
    return f'<a href="{escape(target)}">{_safe(words)}</a>'


def _errors(rows: Sequence[Row]) -> str:
    last = Counter(row["error"].strip().splitlines()[-1] for row in rows if row["error"].strip())
    first = {row["error"].strip().splitlines()[-1]: str(row["run"]) for row in reversed(rows) if row["error"].strip()}
    lines = [(str(count), first[text], text) for text, count in last.most_common(WORST)]
    return _table(("runs", "first", "error"), lines, numbers=(0, 1)) if lines else ""


def _section(title: str, content: str, words: str = "") -> str:
    told = f'<p class="none">{_safe(words)}</p>' if words else ""
    return f"<section><h2>{_safe(title)}</h2>{told}{content}</section>" if content else ""


def _table(heads: Sequence[str], lines: Iterable[Sequence[str]], *, numbers: Iterable[int], safe: bool = False) -> str:
    """A table of texts; if they are `safe` they are HTML already."""
    right = set(numbers)

    def cells(words: Sequence[str], tag: str, as_is: bool) -> str:
        kinds = (' class="n"' if place in right else "" for place in range(len(words)))
        return "".join(
            f"<{tag}{kind}>{word if as_is else _safe(word)}</{tag}>" for kind, word in zip(kinds, words, strict=True)
        )

    body = "".join(f"<tr>{cells(line, 'td', safe)}</tr>" for line in lines)
    return f'<div class="scroll"><table><tr>{cells(heads, "th", False)}</tr>{body}</table></div>'


def _short(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _safe(value: Any) -> str:
    text = str(value)
    return escape(printable(text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 1] + "…"))
