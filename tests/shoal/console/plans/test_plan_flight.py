"""A plan is flown in virtual time before it is stored, in a process that ends with the console."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from shoal.console import Role, Users
from shoal.console.access.page_security import PageSecurity
from shoal.console.charts.depth_contours import depth_contours
from shoal.console.page_job import PageJob, PageJobError
from tests.outside import until
from tests.shoal.console.operator_page import operator_page
from tests.shoal.console.page_of_nobody import served_page

NAME = "lauv-noptilus-1"
SHORT = 'plan: "near"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7059°, depth: 1.5, speed: 1.0 m/s}\n'
FAR = SHORT.replace("-8.7059°", "-8.8000°")
DEEP = SHORT.replace("depth: 1.5", "depth: 500")
WORKER = "shoal.console.plans.plan_flight"
pytestmark = pytest.mark.heavy


def run(*jobs: dict) -> list[dict]:
    async def act() -> list[dict]:
        worker = PageJob(WORKER)
        return [await worker.run(job) for job in jobs]

    return asyncio.run(act())


def test_track_bottom_battery_and_time_of_a_plan():
    place = 41.1851, -8.7061
    (found,) = run({"text": SHORT, "profile": NAME, "place": place})
    assert found["ok"], found
    assert found["text"].startswith("near: plan completed, ")
    assert "% of the battery" in found["text"]
    assert "above the bottom" in found["text"]
    rows = found["rows"]
    assert [time for time, *_ in rows[:3]] == pytest.approx([0.0, 1.0, 2.0], abs=0.2)
    assert tuple(rows[0][1:3]) == pytest.approx(place, abs=2e-5)
    assert tuple(rows[-1][1:3]) == pytest.approx((41.185, -8.7059), abs=1e-4)
    assert max(row[3] for row in rows) == pytest.approx(1.5, abs=0.5)
    assert all(3.0 < row[4] < 6.0 for row in rows)
    assert rows[0][5] >= rows[-1][5] > 99.0


def test_what_cannot_be_flown_has_its_reason():
    deep, bad, nobody = run(
        {"text": DEEP, "profile": NAME},
        {"text": "plan: x", "profile": NAME},
        {"text": SHORT, "profile": "nobody"},
    )
    assert not any(found["ok"] for found in (deep, bad, nobody))
    assert deep["text"].startswith("near would be rejected: ")
    assert "maneuvers: expected a list" in bad["text"]
    assert "there is no profile 'nobody'" in nobody["text"]


def test_one_at_a_time_and_a_flight_can_be_cancelled():
    async def act() -> tuple[float, list[str]]:
        worker, reasons = PageJob(WORKER), []
        flight = asyncio.create_task(worker.run({"text": FAR, "profile": NAME}))
        await asyncio.sleep(1.0)
        with pytest.raises(PageJobError, match="the one before is not finished"):
            await worker.run({"text": SHORT, "profile": NAME})
        began = time.monotonic()
        worker.cancel()
        with pytest.raises(PageJobError) as caught:
            await flight
        reasons.append(str(caught.value))
        return time.monotonic() - began, reasons

    seconds, reasons = asyncio.run(act())
    assert reasons == ["cancelled"]
    assert seconds < 2.0


def worker_ids() -> set[int]:
    found = subprocess.run(["pgrep", "-f", WORKER], capture_output=True, text=True).stdout
    return {int(number) for number in found.split()} - {os.getpid()}


def test_a_flight_ends_with_a_console_that_is_killed(tmp_path):
    script = (
        "import asyncio\nfrom shoal.console.page_job import PageJob\n"
        f"asyncio.run(PageJob({WORKER!r}).run({{'text': {FAR!r}, 'profile': {NAME!r}}}))\n"
    )
    before = worker_ids()
    with subprocess.Popen([sys.executable, "-c", script]) as process:
        own = until(lambda: worker_ids() - before - {process.pid}, 30.0)
        time.sleep(1.0)
        process.send_signal(signal.SIGKILL)
    until(lambda: not own & worker_ids(), 10.0)


def test_the_page_asks_for_a_flight_sees_how_far_it_is_and_stays_quick():
    with operator_page() as page:
        page.log_in()
        names = [("../etc/x", "name the profile"), ("", "name the profile")]
        for profile, reason in names:
            status, content, _ = page.request("POST", "/api/flight", {"text": SHORT, "profile": profile})
            assert (status, json.loads(content)["ok"], reason in json.loads(content)["text"]) == (200, False, True)
        with ThreadPoolExecutor(1) as pool:
            job = {"text": SHORT, "profile": NAME, "vehicle": NAME}
            flight = pool.submit(page.request, "POST", "/api/flight", job)
            percents = []
            while not flight.done():
                percents.append(page.get("/api/flight").get("percent", 0))
                began = time.monotonic()
                assert page.request("GET", "/healthz")[0] == 200
                assert time.monotonic() - began < 1.0
                time.sleep(0.1)
        assert json.loads(flight.result()[1])["ok"], flight.result()
        assert percents == sorted(percents)
        assert max(percents) > 0
        assert page.get("/api/flight") == {"ok": True}


def test_another_user_is_refused_with_the_name_of_who_flies(tmp_path):
    for name, role in (("anna", Role.OPERATE), ("ben", Role.OPERATE), ("carl", Role.MAINTAIN)):
        Users(tmp_path).add(name, role, "correct horse")
    job = {"text": FAR, "profile": NAME}
    with served_page(security=PageSecurity(users=Users(tmp_path))) as page, ThreadPoolExecutor(1) as pool:
        anna, ben, carl = (page.another(user=name, password="correct horse") for name in ("anna", "ben", "carl"))

        def answer(of, path, words) -> dict:
            return json.loads(of.request("POST", path, words)[1])

        before = worker_ids()
        flight = pool.submit(answer, anna, "/api/flight", job)
        until(lambda: worker_ids() - before, 30.0)
        assert answer(ben, "/api/flight", job)["text"].startswith("anna tries a plan in simulation, for ")
        refused = {"ok": False, "text": "anna tries a plan in simulation, and may cancel it", "rows": []}
        assert answer(ben, "/api/flight-cancel", {}) == refused
        assert answer(carl, "/api/flight-cancel", {})["ok"]
        assert flight.result(20.0)["text"] == "cancelled"
        flight = pool.submit(answer, ben, "/api/flight", job)
        until(lambda: worker_ids() - before, 30.0)
        assert answer(ben, "/api/flight-cancel", {})["ok"]
        assert flight.result(20.0)["text"] == "cancelled"


def test_contours_are_where_the_bathymetry_has_their_depth():
    lines = depth_contours(NAME)
    assert len({line["depth"] for line in lines}) >= 4
    for line in lines:
        assert 3.0 < line["depth"] < 5.0
        assert all((lat, lon) == pytest.approx((41.185, -8.7062), abs=0.003) for lat, lon in line["places"])
    assert depth_contours("hexa-00") == []
