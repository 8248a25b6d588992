"""Draws a campaign as one HTML page that needs no other file and no network."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from shoal.campaigns.findings_files import compute_findings, describe_run
from shoal.campaigns.jobs import ResultRow, is_finished
from shoal.campaigns.pass_rate import PassRate
from shoal.campaigns.report.plots import (
    MOST_PLOTS,
    best_so_far_plot,
    histogram_plots,
    pass_rate_plots,
    scatter_plots,
    track_map,
)
from shoal.campaigns.report.sensitivity import (
    Columns,
    SobolIndex,
    critical_correlation,
    eta_squared,
    group_rows_by_choice,
    input_arrays,
    output_arrays,
    rank_correlations,
    sobol_indices,
)
from shoal.campaigns.repro_commands import rerun_command
from shoal.campaigns.results import CampaignResults, ResultsError
from shoal.campaigns.search import SearchFindings, SearchObjective
from shoal.html import escape_text, html_document, html_section, html_table, html_tiles, short_number
from shoal.logs.inspect import format_duration, format_noun_count

LISTED = 20
MOST_INDICES = 12  # outputs
SCATTERS = 6
MEDIANS = 4  # outputs beside each choice
STRONG = 0.1  # a coefficient below is not worth a picture
_HERE = Path(__file__).parent


def campaign_html(data: CampaignResults, beside: Path) -> str:
    """The page of a data set, for a file in the folder `beside`: links to logs are relative to it.

    Text from the data set is escaped. Raises ResultsError if it has no run.
    """
    rows = data.counted_rows
    if not rows:
        raise ResultsError(f"{data.folder} has no run yet")
    passed = np.array([bool(row["passed"]) for row in rows])
    inputs, outputs = input_arrays(rows), output_arrays(rows)
    shown = compute_findings(data)
    if shown is not None:
        first = _of_search(data, rows, shown, inputs, outputs, passed)
    else:
        first = _of_samples(data, rows, inputs, outputs, passed)
    parts = [
        *first,
        html_section("Tracks", track_map(rows), _LEGEND + " Green points are starts."),
        _worst(data, rows, beside) if shown is None else _best(data, rows, shown.objective, beside),
        html_section("Runs that ended out of order", _errors(rows)),
    ]
    about = data.metadata
    file, seed, sampling = (escape_text(about[key]) for key in ("file", "seed", "sampling"))
    body = f"""<main><header><h1>{escape_text(data.name)}</h1><p>{escape_text(about["description"])}</p>
<p>{file} · seed {seed} · sampling {sampling}</p></header>
{"".join(parts)}
<footer>Made with {escape_text(about["versions"])}.</footer></main>"""
    style = (_HERE / "page.css").read_text(encoding="utf-8")
    return html_document(data.name, body, style=style, images=True)


def _of_samples(
    data: CampaignResults, rows: Sequence[ResultRow], inputs: Columns, outputs: Columns, passed: Any
) -> list[str]:
    """Results of runs that are a sample of all that may happen."""
    units, rate = data.metadata["units"], data.pass_rate
    correlations = rank_correlations(inputs, outputs)
    indices = sobol_indices(data, rows, dict(list(outputs.items())[:MOST_INDICES]))
    strongest = _strongest(correlations, indices)
    known = np.array([float(row["passed"]) if is_finished(row) else math.nan for row in rows])
    return [
        _tiles(data, rows, rate),
        html_section("Expectations", _expectations(rows, rate)),
        html_section("Pass rate over what varies, %", pass_rate_plots(inputs, known, units, rate)),
        html_section("Choices", _choices(rows, outputs, rate), _CHOICES),
        _histograms(outputs, passed, units),
        html_section("Rank correlation", _correlations(inputs, outputs, correlations), _CORRELATION),
        html_section("Sobol indices", _indices(indices), _SOBOL),
        html_section("Strongest relations", scatter_plots(strongest, inputs, outputs, passed, units), _LEGEND),
    ]


def _of_search(
    data: CampaignResults,
    rows: Sequence[ResultRow],
    shown: SearchFindings,
    inputs: Columns,
    outputs: Columns,
    passed: Any,
) -> list[str]:
    """Results of the runs of a search: without a pass rate, since the search chose them."""
    goal, units = shown.objective, data.metadata["units"]
    words = (
        (row, title, "<br>".join(map(escape_text, describe_run(shown, row, units)))) for title, row in _kept(shown)
    )
    lines = [(str(row["run"]), title, text) for row, title, text in words]
    found = html_table(("run", "", ""), lines, numbers=(0,), as_is=True)
    values = np.array([goal.value(row) for row in rows], float)
    column = {goal.column: np.where(np.isfinite(values), values, np.nan)}
    pairs = [(name, goal.column) for name in inputs] if np.isfinite(values).any() else []
    tried = [goal.value(row) for row in rows]
    return [
        html_section(f"{goal.extreme_word.capitalize()} {goal.text}", found, data.progress_text),
        html_section(
            "Best so far", best_so_far_plot(tried, shown.best_so_far), "Points: runs. Line: the best until then."
        ),
        html_section(
            "Where it looked", scatter_plots(pairs[:MOST_PLOTS], inputs, {**outputs, **column}, passed, units), _LEGEND
        ),
        _histograms(outputs, passed, units),
    ]


def _histograms(outputs: Columns, passed: Any, units: dict[str, str]) -> str:
    return html_section("Metrics and margins", histogram_plots(outputs, passed, units), _LEGEND + _only_first(outputs))


def _kept(shown: SearchFindings) -> list[tuple[str, ResultRow]]:
    names = ("as it is", shown.objective.extreme_word, "smallest change that fails")
    rows = (shown.baseline, shown.best, shown.smallest_failure)
    return [(name, row) for name, row in zip(names, rows, strict=True) if row is not None]


_DONE = " runs done"
_LEGEND = "Blue: passed. Red: failed."
_CHOICES = "Runs by what they drew, and the medians of the outputs that differ most between them."
_CORRELATION = "Spearman's coefficient: 1 if the output rises with the input, -1 if it falls. Gray may be chance."
_SOBOL = (
    "The share of an output's variance that an input has, by SALib: first, alone; total, with all that it acts "
    "together with. ± is half the interval of 95 %."
)


def _only_first(outputs: Columns) -> str:
    return f" The first {MOST_PLOTS} of {len(outputs)}." if len(outputs) > MOST_PLOTS else ""


def _tiles(data: CampaignResults, rows: Sequence[ResultRow], rate: PassRate) -> str:
    errors = len([row for row in rows if row["error"] and is_finished(row)])
    simulated, cpu = (math.fsum(row[name] for row in rows) for name in ("seconds", "cpu"))
    tiles = [
        ("bad" if rate.ratio < 0.5 else "", rate.ratio_text, "of runs passed"),
        ("", rate.interval_text, f"true pass rate, {100 * rate.confidence:g}% confidence (Wilson)"),
        ("", f"{rate.passed} of {rate.runs}", "runs passed"),
        ("bad" if errors else "", str(errors), "ended out of order"),
        ("fair", str(rate.unknown or ""), "more did not end: outcome unknown"),
        ("", format_duration(simulated), "simulated"),
        ("", format_duration(cpu), "of CPU"),
        ("", f"{len(rows) * 3600.0 / cpu:.0f}" if cpu else "", "runs per hour of CPU"),
    ]
    if data.progress_text:
        tiles.append(("fair", data.progress_text.removesuffix(_DONE), _DONE))
    return html_tiles((value, what, kind) for kind, value, what in tiles if value)


def _expectations(rows: Sequence[ResultRow], whole: PassRate) -> str:
    names = dict.fromkeys(name.partition(".")[2] for row in rows for name in row if name.startswith("verdicts."))
    lines: list[Sequence[str]] = []
    for name in sorted(names):
        judged = [row for row in rows if f"verdicts.{name}" in row]
        kept = len([row for row in judged if row[f"verdicts.{name}"]])
        rate = replace(whole, passed=kept, runs=len(judged), unknown=0)
        margins: Any = np.array([row[f"margins.{name}"] for row in judged], float)
        margins = margins[np.isfinite(margins)]
        least, median = (f"{f(margins):.4g}" if len(margins) else "" for f in (np.min, np.median))
        idle = len([row for row in judged if not row.get(f"applied.{name}", True)])
        lines.append((name, rate.ratio_text, rate.interval_text, least, median, str(idle or "")))
    heads = ("expectation", "passed", "interval", "least margin", "median margin", "never applied")
    return html_table(heads, lines, numbers=range(1, 6)) if lines else ""


def _choices(rows: Sequence[ResultRow], outputs: Columns, whole: PassRate) -> str:
    tables: list[str] = []
    for name, groups in group_rows_by_choice(rows).items():
        shares = {output: eta_squared(list(groups.values()), column) for output, column in outputs.items()}
        shown = sorted((o for o in shares if shares[o] > STRONG), key=lambda output: -shares[output])[:MEDIANS]
        lines: list[Sequence[str]] = []
        for word, group in groups.items():
            known = [row for row in (rows[int(k)] for k in group) if is_finished(row)]
            rate = replace(whole, passed=len([row for row in known if row["passed"]]), runs=len(known), unknown=0)
            medians = [_median(outputs[output][group]) for output in shown]
            lines.append((word, str(rate.runs), rate.ratio_text, rate.interval_text, *medians))
        heads = (name.partition(".")[2], "runs", "passed", "interval", *shown)
        tables.append(html_table(heads, lines, numbers=range(1, len(heads))))
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
            kind = "n soft" if abs(r) < critical_correlation(count) else "n"
            color = f"rgba({'198,47,54' if r < 0 else '23,105,194'},{min(abs(r), 1.0) * 0.7:.2f})"
            cells.append(f'<td class="{kind}" style="background:{color}">{r:+.2f}</td>')
        rows.append(f"<tr><td>{escape_text(output)}</td>{''.join(cells)}</tr>")
    heads = "".join(f'<th class="n">{escape_text(name.partition(".")[2])}</th>' for name in inputs)
    return f'<div class="scroll"><table><tr><th></th>{heads}</tr>{"".join(rows)}</table></div>'


def _indices(found: dict[tuple[str, str], SobolIndex]) -> str:
    lines: list[Sequence[str]] = []
    for (name, output), index in sorted(found.items(), key=lambda item: (item[0][1], -item[1].first_order)):
        total = "" if math.isnan(index.total_order) else f"{index.total_order:.2f} ± {index.total_order_half_width:.2f}"
        lines.append(
            (output, name.partition(".")[2], f"{index.first_order:.2f} ± {index.first_order_half_width:.2f}", total)
        )
    return html_table(("output", "input", "first", "total"), lines, numbers=(2, 3)) if lines else ""


def _strongest(
    found: dict[tuple[str, str], tuple[float, int]], indices: dict[tuple[str, str], SobolIndex]
) -> list[tuple[str, str]]:
    """Pairs of an input and an output that are related, also where an output rises on both sides of the middle."""
    strengths = {
        pair: abs(r) for pair, (r, count) in found.items() if abs(r) > max(STRONG, critical_correlation(count))
    }
    for pair, index in indices.items():
        if index.first_order > max(STRONG, 2.0 * index.first_order_half_width):
            strengths[pair] = max(strengths.get(pair, 0.0), math.sqrt(index.first_order))
    return sorted(strengths, key=lambda pair: -strengths[pair])[:SCATTERS]


def _worst(data: CampaignResults, rows: Sequence[ResultRow], beside: Path) -> str:
    ended = [row for row in rows if is_finished(row)]
    worst = sorted(ended, key=lambda row: (not row["error"], row["passed"], row["margin"], row["run"]))[:LISTED]
    return html_section(
        f"The {format_noun_count(len(worst), 'worst run')}",
        _listed(data, [(row, row["margin"]) for row in worst], "margin", beside),
    )


def _best(data: CampaignResults, rows: Sequence[ResultRow], goal: SearchObjective, beside: Path) -> str:
    """The runs nearest to what a search looks for."""
    values = [(row, value) for row in rows if not math.isnan(value := goal.value(row))]
    best = sorted(values, key=lambda pair: -pair[1] if goal.is_maximized else pair[1])[:LISTED]
    title = f"The {format_noun_count(len(best), 'run')} with the {goal.extreme_word} {goal.text}"
    return html_section(title, _listed(data, best, goal.text, beside) if best else "")


def _listed(data: CampaignResults, rows: Iterable[tuple[ResultRow, float]], name: str, beside: Path) -> str:
    """Runs, each with a value that has this name."""
    lines: list[Sequence[str]] = []
    for row, value in rows:
        drawn = [f"{name.partition('.')[2]} = {short_number(row[name])}" for name in row if name.startswith("values.")]
        links = [_link(data.folder / row[name], name.partition(".")[2], beside) for name in row if _is_log(name)]
        why = row["error"].strip().splitlines()[-1] if row["error"] else row["reason"]
        code = f"<code>{escape_text(rerun_command(data, row['run']))}</code>"
        cells = (
            str(row["run"]),
            f"{value:.4g}",
            escape_text(why),
            escape_text(", ".join(drawn)),
            ", ".join(links) or code,
        )
        lines.append(cells)
    return html_table(("run", name, "why", "drawn", "log, or how to get it"), lines, numbers=(0, 1), as_is=True)


def _is_log(name: str) -> bool:
    return name.startswith("logs.")


def _link(folder: Path, words: str, beside: Path) -> str:
    place, base = folder.resolve(), beside.resolve()
    target = place.relative_to(base).as_posix() if place.is_relative_to(base) else place.as_uri()
    return f'<a href="{escape(target)}">{escape_text(words)}</a>'


def _errors(rows: Sequence[ResultRow]) -> str:
    last = Counter(row["error"].strip().splitlines()[-1] for row in rows if row["error"].strip())
    first = {row["error"].strip().splitlines()[-1]: str(row["run"]) for row in reversed(rows) if row["error"].strip()}
    lines = [(str(count), first[text], text) for text, count in last.most_common(LISTED)]
    return html_table(("runs", "first", "error"), lines, numbers=(0, 1)) if lines else ""
