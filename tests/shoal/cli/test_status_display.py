"""The live panel handles any messages, names and terminals."""

import io

import pytest
from rich.console import Console

import imc
from runtime.kernel import VirtualClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from shoal.cli.status_display import StatusDisplay
from tests.runtime.bus.transport_contract import Wire

STARTED = imc.LoggingControl.Op.STARTED
INFINITE = float("inf")


def show(tmp_path, message=None, title="a vehicle", width=80):
    vehicle = Vehicle("v", 0x1A, clock=VirtualClock(0), profile=NoProfile(), log_root=tmp_path)
    status, screen = StatusDisplay(vehicle, title, None), io.StringIO()
    status._console = Console(file=screen, force_terminal=True, width=width)
    with status:
        vehicle.start()
        if message is not None:
            vehicle.kernel.after(0.5, vehicle.bus.deliver_and_send, message.replace(src=0x1A), b"", None)
        vehicle.run(2.0)
        vehicle.close()
    return screen.getvalue()


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (imc.LoggingControl(op=STARTED, name="[/bold]\x1b]0;x\x07"), r"[/bold]\x1b]0;x\x07"),
        (imc.EstimatedState(lat=INFINITE), "not finite"),
        (imc.EstimatedState(x=float("nan")), "not finite"),
        (imc.EstimatedState(vx=INFINITE), "inf m/s"),
        (imc.LogBookEntry(type=77, text="[/x]\x1b[2J", htime=1e300), r"[/x]\x1b[2J"),
    ],
)
def test_hostile_messages_are_shown_as_text(tmp_path, message, words):
    if isinstance(message, imc.LoggingControl):
        (tmp_path / "v" / message.name).mkdir(parents=True)
    assert words in show(tmp_path, message, width=400)


@pytest.mark.parametrize("name", ["20260101/000000", "../../x", "\0", "x" * 9999, "\udcff"])
def test_a_log_of_another_process_is_not_shown_as_the_own_one(tmp_path, name):
    assert name[:9] not in show(tmp_path, imc.LoggingControl(op=STARTED, name=name), width=400)


def test_a_title_is_no_markup(tmp_path):
    assert "replay of a[/b]c" in show(tmp_path, title="replay of a[/b]c")


def test_detections_are_shown_where_there_are_any(tmp_path):
    assert "detections" not in show(tmp_path, width=400)
    assert "last: MUG 3 at +1.00 m north" in show(tmp_path, imc.EstimatedMugState(id=3, x=1.0), width=400)


def test_malformed_packets_of_others_are_counted_in_the_last_line_and_in_the_log_book(tmp_path):
    vehicle = Vehicle("v", 0x1A, clock=VirtualClock(0), profile=NoProfile(), log_root=tmp_path)
    status, wire, texts = StatusDisplay(vehicle, "a vehicle", None), Wire(), []
    vehicle.observe(imc.LogBookEntry, lambda entry: texts.append(entry.text))
    vehicle.bus.attach_transport(wire)
    vehicle.start()
    for packet in (b"", b"junk of a stranger", imc.encode(imc.Depth(src=7))[:-1]):
        wire.receive(packet)
    vehicle.run(1.0)
    vehicle.close()
    assert "messages, 3 of others malformed" in status.run_summary()
    assert "3 malformed packets of others dropped in this run" in texts
    assert sum(text.startswith("packet from 0x") for text in texts) == 3


@pytest.mark.parametrize("width", [1, 3, 5])
def test_a_narrow_terminal_is_borne(tmp_path, width):
    assert show(tmp_path, width=width)
