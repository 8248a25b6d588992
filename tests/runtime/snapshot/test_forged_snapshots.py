"""Snapshots from others: a forged one is refused, or the run goes on; nothing is written outside, no code is run."""

import os
import random
import re
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from runtime.snapshot import load, take_snapshot
from tests.runtime.snapshot.adversary import forgeries, opened, outcome, running, sealed, texts

TEXT: Any = "x"  # where the types promise a number
LONG = (pytest.mark.heavy, pytest.mark.computing)
NOTHING = [["new", 1_000_001, "list", []], ["new", 1_000_002, "dict", []]]


@pytest.fixture(scope="module")
def states(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A real snapshot without scripts, and one of a vehicle whose plan engine and maneuver run scripts."""
    found = dict[str, bytes]()
    for profile, seconds in (("lauv-noptilus-1", 1.03), ("caravel", 3.03)):
        vehicle = running(profile, tmp_path_factory.mktemp(profile), seconds)
        found[profile] = take_snapshot(vehicle)
        vehicle.close()
    assert load(found["caravel"]).journals
    return found


@pytest.fixture(scope="module")
def watch() -> Iterator[list[str]]:
    """What the process writes, runs and connects to, outside of temporary files; an audit hook stays for ever."""
    seen, active = list[str](), [True]
    calls = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "socket.connect", "os.remove", "os.rename"}

    def hook(event: str, args: tuple[Any, ...]) -> None:
        if not active:
            return
        writes = event == "open" and isinstance(args[0], (str, bytes)) and args[2] & (os.O_WRONLY | os.O_RDWR)
        if writes or (event in ("os.mkdir", "sqlite3.connect") and args[0] != ":memory:"):
            seen.append(os.path.realpath(os.fsdecode(args[0])))
        elif event in calls and not str(args[0]).endswith("Config.ini"):
            seen.append(event)

    sys.addaudithook(hook)
    yield seen
    active.clear()


def escaped(seen: list[str], jail: Path) -> list[str]:
    """What of it is outside the log folder; the configuration is read from a temporary file."""
    allowed = re.compile(rf"{re.escape(str(jail))}/log(/|$)|.*/tmp\w{{8}}(/Config\.ini)?$|.*__pycache__")
    return [path for path in seen if not allowed.match(path)]


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "count"),
    [
        ("lauv-noptilus-1", 15),
        ("caravel", 10),
        pytest.param("lauv-noptilus-1", 60, marks=LONG),
        pytest.param("caravel", 40, marks=LONG),
    ],
)
def test_a_forged_snapshot_is_refused_or_goes_on(
    states: dict[str, bytes], tmp_path: Path, watch: list[str], profile: str, count: int
) -> None:
    watch.clear()
    reasons = [outcome(state, tmp_path) for _, state in forgeries(states[profile], count, seed=5)]
    assert escaped(watch, tmp_path) == []
    bad = [r for r in reasons if not r.isprintable() or len(r) >= 500]
    assert not bad
    assert count / 3 < sum(map(bool, reasons)) < count
    assert outcome(states[profile], tmp_path) == ""


@pytest.mark.heavy
@pytest.mark.parametrize("text", ["../../../escaped", pytest.param("/tmp/escaped", marks=LONG)])
def test_a_path_in_any_text_leads_nowhere(
    states: dict[str, bytes], tmp_path: Path, watch: list[str], text: str
) -> None:
    watch.clear()
    content = opened(states["lauv-noptilus-1"])
    for here, key in random.Random(6).sample(texts(content), 20):
        before, here[key] = here[key], text
        outcome(sealed(content), tmp_path)
        here[key] = before
    for attribute in logger_of(content):
        if isinstance(attribute[1], str):
            before, attribute[1] = attribute[1], text
            outcome(sealed(content), tmp_path)
            attribute[1] = before
    assert escaped(watch, tmp_path) == []
    assert not Path("/tmp/escaped").exists()


def logger_of(content: Any) -> list[Any]:
    return content["tasks"]["Transports.Logging"][2]


@pytest.mark.parametrize("whole", [True, False], ids=["restored", "not restored"])
def test_what_cannot_stop_is_one_error_of_the_snapshot(
    states: dict[str, bytes], tmp_path: Path, caplog: pytest.LogCaptureFixture, whole: bool
) -> None:
    content = opened(states["lauv-noptilus-1"])
    for state in content["tasks"].values():
        for attribute in state[2]:
            if attribute[0] == "_round":
                attribute[1] = TEXT
    if not whole:
        content["subscriptions"].pop()
    reason = outcome(sealed(content), tmp_path, 0.0)
    assert ("failed with the state of the snapshot: TypeError" in reason) == whole
    assert ("a subscription is missing" in reason) != whole
    assert not caplog.records


def test_a_forged_label_stays_in_the_log_folder(states: dict[str, bytes], tmp_path: Path, watch: list[str]) -> None:
    watch.clear()
    content = opened(states["lauv-noptilus-1"])
    for attribute in logger_of(content):
        if attribute[0] == "_label":
            attribute[1] = "/../../../../escaped"
    assert outcome(sealed(content), tmp_path) == ""
    assert escaped(watch, tmp_path) == []
    (log,) = tmp_path.glob("log/lauv-noptilus-1/*/*")
    assert "escaped" in log.name


@pytest.mark.parametrize(
    ("attribute", "reason"),
    [
        ("_logs", "cannot have an attribute '_logs'"),
        ("vehicle", "cannot have an attribute 'vehicle'"),
        ("publish", "cannot have an attribute 'publish'"),
        ("__class__", "cannot have an attribute '__class__'"),
        ("now", "cannot have an attribute 'now'"),
    ],
)
def test_a_task_takes_only_attributes_of_its_own(
    states: dict[str, bytes], tmp_path: Path, attribute: str, reason: str
) -> None:
    content = opened(states["lauv-noptilus-1"])
    logger_of(content).append([attribute, 1])
    assert reason in outcome(sealed(content), tmp_path)


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (["type", "imc.messages:Goto"], "not one of a task"),
        (
            ["partial", ["type", "imc.messages:Goto"], ["new", 10**6, "list", []], ["new", 1000001, "dict", []]],
            "not of a method",
        ),
        (["method", ["task", "Daemon"], "offload"], "'offload' of a Daemon cannot be called"),
        (["method", ["task", "Daemon"], "__init__"], "'__init__' of a Daemon cannot be called"),
        (["method", ["bus"], "attach_transport"], "'attach_transport' of a Bus cannot be called"),
        (["method", ["vehicle"], "close"], "'close' of a Vehicle cannot be called"),
        (["method", ["new", 10**6, "object", "tasks.transports.logging:Logging", []], "_tick"], "a Logging is nothing"),
        (["type", "tasks.plan.store:PlanStore"], "the class PlanStore is nothing"),
    ],
)
def test_a_pending_call_is_a_method_of_a_task(
    states: dict[str, bytes], tmp_path: Path, function: Any, reason: str
) -> None:
    content = opened(states["lauv-noptilus-1"])
    content["timers"][0][2] = function
    assert reason in outcome(sealed(content), tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (b"Vehicle = lauv-noptilus-1", b"Vehicle = ../../escaped", "cannot be the name of a vehicle"),
        (b"[General]", b"[Require /dev/zero]\n[General]", "its configuration includes files"),
        (
            b"[General]",
            b"[ include ../../../x.ini]\n[antigravity.Flight]\nEnabled = Always\n[General]",
            "module|includ",
        ),
        (b"[General]", b"[antigravity.Flight]\nEnabled = Always\n[General]", "antigravity"),
    ],
)
def test_a_forged_configuration_is_refused(
    states: dict[str, bytes], tmp_path: Path, watch: list[str], old: bytes, new: bytes, reason: str
) -> None:
    watch.clear()
    content = opened(states["lauv-noptilus-1"])
    assert old in content["configuration"]
    content["configuration"] = content["configuration"].replace(old, new, 1)
    found = outcome(sealed(content), tmp_path)
    assert re.search(reason, found)
    assert "/tmp" not in found
    assert "antigravity" not in sys.modules
    assert escaped(watch, tmp_path) == []


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("time", -1, "impossible time"),
        ("time", 2**63 - 1, "impossible time"),
        ("start_time", float("nan"), "times do not fit"),
        ("start_time", -1e300, "times do not fit"),
        ("sections", [], "other tasks"),
        ("running", ["Nobody"], "not exactly one state"),
        ("tasks", {}, "not exactly one state"),
        ("subscriptions", ["Daemon"] * 1000, "does not fit the vehicle"),
        ("entities", [["Nobody", 7, 0, "", True]], "no entity 'Nobody'"),
        ("timers", [], "does not fit|missing"),
    ],
)
def test_what_does_not_fit_is_named(
    states: dict[str, bytes], tmp_path: Path, field: str, value: Any, reason: str
) -> None:
    content = opened(states["lauv-noptilus-1"])
    content[field] = value
    assert re.search(reason, outcome(sealed(content), tmp_path))


@pytest.mark.heavy
def test_a_journal_that_unpacks_to_much_is_refused(states: dict[str, bytes], tmp_path: Path) -> None:
    content = opened(states["caravel"])
    past = next(iter(content["journals"].values()))
    for data, reason in [
        (b"\0" * (1 << 27), "cut off"),
        (b"\x92\x90" + b"\xdd\x03\xff\xff\xff" + b"\x90" * (1 << 25), "more than 1000000 values"),
        (b"\x91" * 10_000, "nested too deep"),
        (b"\x91\x90", "a journal is damaged"),
    ]:
        past[4] = [zlib.compress(data, 1)]
        assert reason in outcome(sealed(content), tmp_path)
