"""The texts that `shoal send` takes for the fields of a message, and how it repeats one."""

import asyncio
import contextlib
import json
import math
import re
import threading
from collections.abc import Iterator

import click
import pytest
from click.testing import Result

import imc
from shoal.cli.field_values import format_fields
from shoal.cli.send import build_message
from tests.command import shoal
from tests.outside import until
from tests.shoal.network.station import Station, discovery_ports, living


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("EstimatedState", "psi=90deg", math.pi / 2),
        ("EstimatedState", "lat=41.1850001°", math.radians(41.1850001)),
        ("EstimatedState", "lon=-8.7062deg", math.radians(-8.7062)),
        ("EstimatedState", "lat=0.7188", 0.7188),
        ("EstimatedState", "lat=nan", math.nan),
        ("Reference", "lat=41.18°", math.radians(41.18)),
        ("VerticalProfile", "lat=41.18°", 41.18),
        ("EstimatedState", "depth=-inf", -math.inf),
        ("EstimatedState", "depth=NaN", math.nan),
        ("PlanControl", "op=stop", imc.PlanControl.Op.STOP),
        ("PlanControl", "flags=CALIBRATE|IGNORE_ERRORS", 3),
        ("PlanControl", "flags=0x2|1", 3),
        ("PlanControl", "request_id=010", 10),
        ("PlanControl", "plan_id=12", "12"),
        ("PlanControl", 'arg={"abbrev": "Goto", "speed": 1.5}', imc.Goto(speed=1.5)),
        ("PlanControl", 'arg={"abbrev": "Goto", "lat": "41.18°"}', imc.Goto(lat=math.radians(41.18))),
        ("DevDataBinary", "value=12", b"\x12"),
    ],
)
def test_a_text_is_read_as_the_type_of_its_field_asks(name: str, text: str, value: object) -> None:
    found = getattr(build_message(name, (text,), imc.builtin()), text.partition("=")[0])
    assert found == (pytest.approx(value, nan_ok=True) if isinstance(value, float) else value)


@pytest.mark.parametrize(
    ("name", "texts", "reason"),
    [
        ("EstimatedState", "deph=3", "EstimatedState has no field 'deph'; did you mean 'depth'?"),
        ("EstimatedState", "depth=", "depth: '' is not a number"),
        ("EstimatedState", "depth=1e400", "depth: '1e400' is not a number"),
        ("EstimatedState", "psi=15degrees", "psi: '15degrees' is not an angle, such as 0.26 or 15deg"),
        ("EstimatedState", "lat=41.18", "lat: 41.18 rad is no latitude; write 41.18° for degrees"),
        ("EstimatedState", "lon=-8.7", "lon: -8.7 rad is no longitude; write -8.7° for degrees"),
        ("EstimatedState", "lat=91°", "lat: 91° is no latitude"),
        ("EstimatedState", "lat=41.18m", "lat: '41.18m' is not an angle, such as 0.26 or 15deg"),
        ("Rpm", "value=1.5", "value: '1.5' is not a whole number"),
        ("Rpm", "value=40000", "value: 40000 is not within -32768 to 32767 (int16_t)"),
        ("PlanControl", "op=STRAT", "op: 'STRAT' is not one of START, STOP, LOAD, GET, and no whole number"),
        ("PlanControl", "flags=CALIBRATE|", "flags: 'CALIBRATE|' is not one of CALIBRATE, IGNORE_ERRORS, and"),
        ("DevDataBinary", "value=zz", "value: 'zz' is not bytes in hexadecimal digits, such as 00ff"),
        ("PlanControl", "arg=Goto", 'arg: \'Goto\' is not JSON, such as {"abbrev": "IdleManeuver", "duration": 10}'),
        ("PlanControl", 'arg={"duration": 3}', 'arg: there is no "abbrev", the name of the message'),
        ("PlanControl", "op", "'op' is not FIELD=VALUE"),
        ("PlanControl", "info=a info=b", "info is given twice"),
    ],
)
def test_a_text_that_does_not_fit_is_named_with_its_field(name: str, texts: str, reason: str) -> None:
    given = (texts,) if "{" in texts else tuple(texts.split())
    with pytest.raises(click.UsageError, match=f"^{re.escape(reason)}"):
        build_message(name, given, imc.builtin())


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        (imc.Goto(lat=math.radians(41.18500004), lon=math.radians(-8.7062)), "lat=41.1850000° lon=-8.7062000°"),
        (imc.PathControlState(end_lat=math.radians(-1e-7)), "end_lat=-0.0000001°"),
        (imc.EstimatedState(psi=1.5), "psi=1.5"),
        (imc.GpsFix(lat=math.nan), "lat=nan"),
        (imc.VerticalProfile(lat=41.18), "lat=41.1800000°"),
    ],
)
def test_latitude_and_longitude_are_shown_in_degrees(message: imc.Message, shown: str) -> None:
    names = tuple(word.partition("=")[0] for word in shown.split())
    assert format_fields(message, names) == shown
    inside = imc.PlanControl(arg=message)
    assert format_fields(inside, tuple(f"arg.{name}" for name in names)).replace("arg.", "") == shown


class RateStation(Station):
    """Answers each EntityList QUERY."""

    def answers(self, message: imc.Message) -> list[imc.Message]:
        asked = isinstance(message, imc.EntityList) and message.op == imc.EntityList.Op.QUERY and message.src_ent == 0
        return [imc.EntityList(list="GPS=3").replace(dst=message.src)] if asked else []


@contextlib.contextmanager
def station_there(monkeypatch: pytest.MonkeyPatch, leaves_after: type[imc.Message] | None = None) -> Iterator[Station]:
    """A station in a thread of its own, to which the commands of this process lead; it may leave after a message."""
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_CONNECT", "udp")
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")
    station, end = RateStation(ports), threading.Event()

    async def live() -> None:
        async with living(station):
            while not end.is_set() and not (leaves_after and received(station, leaves_after)):
                await asyncio.sleep(0.02)

    thread = threading.Thread(target=lambda: asyncio.run(live()))
    thread.start()
    try:
        yield station
    finally:
        end.set()
        thread.join()


def send(*words: str) -> Result:
    return shoal("send", "station", *words)


def received(station: Station, kind: type[imc.Message]) -> list[imc.Message]:
    return [message for message in list(station.heard) if isinstance(message, kind)]


@pytest.mark.heavy
def test_a_rate_sends_new_messages_without_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    with station_there(monkeypatch) as station:
        counted = send("DesiredSpeed", "value=1.2", "--rate", "50", "--count", "20")
        assert counted.exit_code == 0, counted.output
        assert counted.output.startswith("sent DesiredSpeed to station 20 times in ")
        until(lambda: len(received(station, imc.DesiredSpeed)) == 20, 5.0)
        times = [message.timestamp for message in received(station, imc.DesiredSpeed)]
        assert len(set(times)) == 20
        assert times[-1] - times[0] > 18.5 / 50, "late messages are not sent in a burst"
        timed = send("DesiredZ", "value=3", "--rate", "20", "--for", "1s")
        assert timed.exit_code == 0, timed.output
        sent = int(timed.output.split()[4])
        assert 2 < sent <= 20
        until(lambda: len(received(station, imc.DesiredZ)) == sent, 5.0)


@pytest.mark.heavy
def test_replies_are_shown_while_messages_are_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    with station_there(monkeypatch):
        found = send("EntityList", "op=QUERY", "--rate", "10", "--count", "4", "--wait", "1s", "--json")
    assert found.exit_code == 0, found.output
    assert [json.loads(line)["list"] for line in found.stdout.splitlines()] == ["GPS=3"] * 4


@pytest.mark.heavy
def test_sending_ends_when_the_vehicle_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    with station_there(monkeypatch, leaves_after=imc.DesiredSpeed):
        found = send("DesiredSpeed", "value=1.2", "--rate", "10")
    assert found.exit_code == 1
    assert "Error: station is " in found.stderr


@pytest.mark.parametrize(
    "words", [("--count", "3"), ("--for", "3s"), ("--rate", "0"), ("--rate", "5", "--count", "3", "--for", "1s")]
)
def test_a_count_needs_a_rate(words: tuple[str, ...]) -> None:
    assert send("DesiredSpeed", "value=1", *words).exit_code == 2


def test_a_rate_that_is_no_number_is_rejected() -> None:
    found = send("DesiredSpeed", "value=1", "--rate", "nan Hz", "--count", "3")
    assert found.exit_code == 2
    assert "'nan Hz' is not a rate" in found.stderr
