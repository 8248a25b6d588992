"""The XML for continuous integration is what its readers take, whatever names and reasons say."""

import re
from pathlib import Path
from xml.etree import ElementTree

from shoal.campaigns import Job, ScenarioOutcome, UnreadableResult, junit_xml
from shoal.scenarios import ExpectationVerdict, ScenarioResult

# What the schemas of Jenkins (junit-10.xsd) and of Ant (JUnit.xsd) have in common: children in order, attributes that
# both know, and those that one of them asks for.
SUITE = {"name", "tests", "failures", "errors", "skipped", "time", "timestamp", "hostname", "package", "id"}
ELEMENTS = {
    "testsuites": (r"(testsuite )*", set(), set()),
    "testsuite": (r"properties (testcase )*system-out system-err ", SUITE, SUITE),
    "testcase": (r"((skipped|failure) )?", {"name", "classname", "time"}, {"name", "classname", "time"}),
    "properties": (r"", set(), set()),
    "failure": (r"", {"type", "message"}, {"type"}),
    "skipped": (r"", {"type", "message"}, set()),
    "system-out": (r"", set(), set()),
    "system-err": (r"", set(), set()),
}


def check(element):
    children, known, needed = ELEMENTS[element.tag]
    assert re.fullmatch(children, "".join(f"{child.tag} " for child in element)), element.tag
    assert needed <= set(element.attrib) <= known, element.attrib
    for child in element:
        check(child)


def outcome(name, result, wall=1.5):
    return ScenarioOutcome(Job(name, Path(f"a/b/{name}.scenario.yaml")), result, wall)


def read(outcomes, undone=()):
    root = ElementTree.fromstring(junit_xml(outcomes, undone, 1.7e9, 2.25))
    check(root)
    return root[0]


def test_each_scenario_is_a_case():
    bad = ExpectationVerdict("depth", False, -0.5, "failed first at 3.000 s", origin="a/b/bad.scenario.yaml:4")
    good = ExpectationVerdict("speed", True, 2.0)
    suite = read(
        [
            outcome("good", ScenarioResult("good", 0, (good,), {"drift": 1.25}, warnings=("it proved nothing",))),
            outcome("bad", ScenarioResult("bad", 0, (good, bad), logs={"lauv": Path("log/bad")})),
            outcome("wrong", UnreadableResult("wrong", 0, error="a/b/wrong.scenario.yaml:1: no\nmore")),
        ],
        [Job("x", Path("later.scenario.yaml"))],
    )
    numbers = {name: suite.get(name) for name in ("tests", "failures", "errors", "skipped", "time", "timestamp")}
    assert numbers == {
        "tests": "4",
        "failures": "2",
        "errors": "0",
        "skipped": "1",
        "time": "2.250",
        "timestamp": "2023-11-14T22:13:20",
    }
    cases = {case.get("name"): case for case in suite.iter("testcase")}
    assert {name: [child.tag for child in case] for name, case in cases.items()} == {
        "good": [],
        "bad": ["failure"],
        "wrong": ["failure"],
        "later": ["skipped"],
    }
    assert cases["bad"].get("classname") == "a.b"
    failure = cases["bad"][0]
    assert (failure.get("type"), failure.get("message")) == ("expectation", "depth: failed first at 3.000 s")
    assert failure.text.splitlines() == [
        "a/b/bad.scenario.yaml:4: depth: failed first at 3.000 s",
        "log: log/bad",
    ]
    assert cases["wrong"][0].get("type") == "error"
    assert cases["wrong"][0].text.splitlines() == ["a/b/wrong.scenario.yaml:1: no", "more"]
    assert suite.find("system-out").text.splitlines() == ["good: warning: it proved nothing", "good: drift = 1.25"]


def test_any_text_can_be_read_back():
    odd = "\x00\x1b[31m<&\"'>\udcff\ufffe\u2028 ü"
    suite = read(
        [
            outcome(
                "odd", ScenarioResult(odd, 0, (ExpectationVerdict(odd, False, reason=odd),), error=odd, warnings=(odd,))
            )
        ]
    )
    case = suite.find("testcase")
    assert case.get("name") == "\\x00\\x1b[31m<&\"'>\\xff\\ufffe\\u2028 ü"
    assert suite.find("system-out").text


def test_nothing_was_run():
    assert read([]).get("tests") == "0"
