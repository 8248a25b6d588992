"""Rates of messages: of a network while they are asked for, on the bus of a vehicle, and over a whole log."""

import asyncio
import json
import time

import pytest

import imc
from shoal.console import LogLink
from shoal.console.health.message_rates import KindCount
from shoal.logs.log_states import LogStates
from tests.outside import until
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.page_of_nobody import served_page

NAME = "lauv-noptilus-1"
HEAD = {"src": 0x1A, "src_ent": 1}


class Counter:
    """A counter whose numbers grow by 5 in each s of its own clock, that runs four times as fast."""

    def __init__(self):
        self.calls = []

    def start(self):
        self.calls.append("start")
        self.began = self.now()

    def stop(self):
        self.calls.append("stop")

    def counts(self):
        return {(NAME, "Depth", 1): KindCount(int(5 * (self.now() - self.began)), self.now())}

    def now(self):
        return 4.0 * time.monotonic()


def rates(page, vehicle=NAME):
    status, content, _ = page.request("GET", f"/api/rates?vehicle={vehicle}")
    assert status == 200, content
    return json.loads(content)


def test_rates_are_counted_by_the_clock_of_the_vehicle_and_only_while_somebody_asks(monkeypatch):
    monkeypatch.setattr("shoal.console.health.message_rates.ASKED", 1.5)
    monkeypatch.setattr("shoal.console.health.message_rates.PERIOD", 0.2)
    radio, counter = Radio(), Counter()
    with served_page(radio, counter=counter) as page:
        page.log_in()
        radio.bring(imc.Heartbeat(timestamp=time.time(), **HEAD))
        assert rates(page, "nobody") == {"ok": False, "text": "there is no such vehicle"}
        until(lambda: counter.calls == ["start"])
        until(lambda: rates(page)["rows"])
        until(lambda: rates(page)["seconds"] > 3.0)
        ((message, _, count, rate, age),) = rates(page)["rows"]
        assert (message, rate) == ("Depth", pytest.approx(5.0, abs=1.0))
        assert count > 0 <= age
        until(lambda: counter.calls == ["start", "stop"])


class LateCounter(Counter):
    """One whose vehicle receives the start a little later, and has the counts of the time before until then."""

    has_started = False

    def start(self):
        super().start()
        asyncio.get_running_loop().call_soon(lambda: setattr(self, "has_started", True))

    def counts(self):
        return super().counts() if self.has_started else {(NAME, "Depth", 1): KindCount(1_000_000, 0.0)}


def test_counts_of_the_time_before_make_no_rate(monkeypatch):
    monkeypatch.setattr("shoal.console.health.message_rates.PERIOD", 0.2)
    radio = Radio()
    with served_page(radio, counter=LateCounter()) as page:
        page.log_in()
        radio.bring(imc.Heartbeat(timestamp=time.time(), **HEAD))
        rows = until(lambda: rates(page).get("rows"))
        assert rows[0][3] >= 0.0


def test_what_arrives_from_a_network_is_counted_by_entity():
    radio = Radio()
    with served_page(radio) as page:
        page.log_in()
        began = time.time()
        radio.bring(imc.Heartbeat(timestamp=began, **HEAD))
        rates(page)

        def rows():
            for entity in (1, 2):
                radio.bring(imc.Temperature(timestamp=time.time(), src=0x1A, src_ent=entity, value=1.0))
            return [row[:2] for row in rates(page)["rows"]]

        until(lambda: {("Temperature", "1"), ("Temperature", "2")} <= set(map(tuple, rows())))


def test_a_log_has_the_rates_of_all_of_it(tmp_path):
    announce = imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, timestamp=1.7e9, **HEAD)
    label = imc.EntityInfo(id=1, label="<img src=x>", timestamp=1.7e9, **HEAD)
    states = [imc.EstimatedState(depth=1.0, timestamp=1.7e9 + number / 2, **HEAD) for number in range(21)]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, (announce, label, *states))))
    player = LogLink(LogStates(tmp_path / "Data.lsf"))
    with served_page(player, player=player, log_root=tmp_path / "resumed") as page:
        page.log_in()
        found = {row[0]: row[1:] for row in rates(page)["rows"]}
        assert found["EstimatedState"] == ["<img src=x>", 21, 2.0, None]  # the last one is to come
        assert found["Announce"][1:3] == [1, None]
        page.request("POST", "/api/replay", {"position": 10.0})
        assert {row[0]: row[4] for row in rates(page)["rows"]}["EstimatedState"] == 0.0
        (tmp_path / "Data.lsf").unlink()
        status, content, _ = page.request("GET", "/api/logs")
        assert (status, json.loads(content)["logs"]) == (200, [])
