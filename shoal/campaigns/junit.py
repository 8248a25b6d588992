"""Results of scenarios, as the XML that programs for continuous integration read (JUnit's)."""

import platform
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from shoal.campaigns.jobs import Job
from shoal.campaigns.run_outcome_text import failure_details, failure_lines, warning_lines
from shoal.campaigns.scenario_suite import ScenarioOutcome
from support.terminal_text import printable


def junit_xml(outcomes: Iterable[ScenarioOutcome], undone: Iterable[Job], began: float, wall: float) -> bytes:
    """A suite with a test case for each file. `began` is in s since 1970, `wall` how long all took (s).

    Every reason for which a case has not passed is a failure, its type is `expectation` or `error`: the readers agree
    on this element only. Metrics and warnings are the output of the suite.
    """
    outcomes, undone = list(outcomes), list(undone)
    failures = len([outcome for outcome in outcomes if not outcome.result.passed])
    suites = ElementTree.Element("testsuites")
    suite = ElementTree.SubElement(
        suites,
        "testsuite",
        {
            "name": "shoal",
            "tests": str(len(outcomes) + len(undone)),
            "failures": str(failures),
            "errors": "0",
            "skipped": str(len(undone)),
            "time": f"{wall:.3f}",
            "timestamp": datetime.fromtimestamp(began, UTC).strftime("%Y-%m-%dT%H:%M:%S"),
            "hostname": platform.node(),
            "package": "",
            "id": "0",
        },
    )
    ElementTree.SubElement(suite, "properties")
    for outcome in outcomes:
        case = _case(suite, outcome.job.path, outcome.result.scenario, outcome.wall_time)
        if not outcome.result.passed:
            kind = "error" if outcome.result.error else "expectation"
            message = "; ".join(failure_lines(outcome.result))
            failure = ElementTree.SubElement(case, "failure", {"type": kind, "message": printable(message)})
            logs = [f"log: {folder}" for folder in outcome.result.logs.values()]
            failure.text = "\n".join(map(printable, [*failure_details(outcome.result), *logs]))
    for job in undone:
        ElementTree.SubElement(_case(suite, job.path, job.name, 0.0), "skipped")
    ElementTree.SubElement(suite, "system-out").text = "\n".join(map(printable, _notes(outcomes)))
    ElementTree.SubElement(suite, "system-err")
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, "utf-8", xml_declaration=True) + b"\n"


def _case(suite: ElementTree.Element, path: Path, name: str, wall: float) -> ElementTree.Element:
    folder = ".".join(part for part in path.parent.parts if part not in ("..", path.anchor)) or "scenarios"
    about = {"classname": printable(folder), "name": printable(name), "time": f"{wall:.3f}"}
    return ElementTree.SubElement(suite, "testcase", about)


def _notes(outcomes: Iterable[ScenarioOutcome]) -> Iterator[str]:
    for outcome in outcomes:
        name, result = outcome.result.scenario, outcome.result
        yield from (f"{name}: warning: {warning}" for warning in warning_lines(outcome))
        yield from (f"{name}: {metric} = {value:.9g}" for metric, value in result.metrics.items())
