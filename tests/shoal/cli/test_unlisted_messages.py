"""A console that waits for messages that a vehicle does not send over its link gets the reason."""

from pathlib import Path

import pytest

from tests.command import shoal
from tests.repeats import repeat
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
pytestmark = pytest.mark.heavy


@pytest.mark.parametrize(("network", "task"), [("udp", "Transports.UDP"), repeat(("tcp", "Transports.TCP.Server"))])
def test_a_type_that_the_link_does_not_carry_is_named_with_the_list(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, network: str, task: str
) -> None:
    monkeypatch.setattr("shoal.cli.spy.QUIET", 0.5)
    with running(tmp_path, network=network):
        silent = shoal("spy", NAME, "Depth", "--for", "20s")
        listed = shoal("spy", NAME, "PlanControl", "--for", "3s")
    reason = f"Depth: not in [{task}] Transports of {NAME}; add it there or to [General] Console Messages"
    assert (silent.exit_code, reason in silent.stderr) == (1, True), silent.output
    assert (listed.exit_code, "not in" in listed.stderr) == (1, False), listed.output


def test_over_zenoh_all_types_come_and_silence_is_no_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.cli.spy.QUIET", 0.5)
    with running(tmp_path, network="zenoh"):
        silent = shoal("spy", NAME, "Sms", "--for", "3s")
    assert (silent.exit_code, "not in" in silent.stderr) == (1, False), silent.output
