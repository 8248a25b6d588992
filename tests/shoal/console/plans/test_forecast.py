"""The rest of a running plan is simulated beside the vehicle: with the reasons where that is impossible."""

import asyncio
import json
import math

import pytest
from starlette.requests import Request

import imc
from autonomy.plans import remaining_plan_at, sequential_plan
from shoal.console import Role, User
from shoal.console.page_job import PageJob
from shoal.console.plans.forecast_routes import ForecastRoutes, _parameters
from shoal.console.plans.forecast_summary import describe_runs, enclosing_circles
from shoal.network import AsyncRemoteVehicle, Network, make_network
from support.wgs84 import displace
from tests.outside import until
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.operator_page import vehicle_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
ANNA, BEN, CARL = User("anna", Role.OPERATE), User("ben", Role.OPERATE), User("carl", Role.MAINTAIN)
LAT, LON = math.radians(41.185), math.radians(-8.7062)
WORKER = "shoal.console.plans.forecast_worker"
PLAN = """plan: "square"
maneuvers:
- goto: {lat: 41.1852°, lon: -8.7060°, depth: 2, speed: 1.2 m/s}
- goto: {lat: 41.1856°, lon: -8.7060°, depth: 2, speed: 1.2 m/s}
- goto: {lat: 41.1852°, lon: -8.7056°, depth: 2, speed: 1.2 m/s}
"""


def run(seconds: float | None, outcome: str, east: float, *crossed: str, battery: float | None = 50.0) -> dict:
    rows = []
    for time in (0.0, 10.0, 20.0):
        lat, lon, _ = displace(LAT, LON, 0.0, time, east * time / 20.0)
        rows.append([time, math.degrees(lat), math.degrees(lon), 2.0, battery])
    return {"rows": rows, "seconds": seconds, "outcome": outcome, "battery": battery, "crossed": list(crossed)}


def test_the_summary_has_each_number_with_the_count_of_runs():
    runs = [
        run(101.6, "completed", 0.0, "touches the bottom"),
        run(120.2, "completed", 4.0, battery=47.25),
        run(None, "", -4.0, "touches the bottom"),
        run(15.0, "vehicle errors: DVL", 0.0, "DVL: silent", battery=None),
    ]
    assert describe_runs(runs, 300.0) == (
        "4 runs to 300 s; the plan ends in 102 to 120 s in 2 of 4; the plan continues beyond 300 s in 1 of 4; "
        "fails (vehicle errors: DVL) in 1 of 4; battery at the end 47.2 to 50.0 %; touches the bottom in 2 of 4; "
        "DVL: silent in 1 of 4"
    )
    assert "no limit is crossed in 1 of 1" in describe_runs(runs[1:2], 300.0)


def test_a_circle_encloses_the_places_of_all_runs_at_its_time():
    circles = enclosing_circles([run(None, "", east) for east in (-8.0, 0.0, 8.0)], 300.0)
    assert [circle["seconds"] for circle in circles] == [5, 10, 15, 20]
    assert [circle["radius"] for circle in circles] == pytest.approx([0.0, 4.0, 4.0, 8.0], abs=0.2)
    assert circles[-1]["lat"] == pytest.approx(math.degrees(displace(LAT, LON, 0.0, 20.0, 0.0)[0]), abs=1e-6)
    assert enclosing_circles([], 300.0) == []
    assert enclosing_circles([{**run(None, "", 0.0), "rows": []}], 300.0) == []


def job(**words: object) -> dict:
    path = imc.FollowPath(
        lat=LAT,
        lon=LON,
        z=2.0,
        z_units=imc.ZUnits.DEPTH,
        speed=1.2,
        speed_units=imc.SpeedUnits.METERS_PS,
        points=tuple(imc.PathPoint(x=x, y=y) for x, y in ((20, 20), (60, 20), (60, 50), (20, 50))),
    )
    place = displace(LAT, LON, 0.0, 40.0, 20.0)[:2]
    plan = remaining_plan_at(sequential_plan("p", {"path": path}), "path", place)
    state = {"place": list(map(math.degrees, place)), "heading": 0.0, "pitch": 0.0, "depth": 2.0, "speed": 1.2}
    known = {
        "altitude": 0.0,
        "battery": 80.0,
        "uncertainty": 1.0,
        "current": [0.0, 0.0],
        "current_spread": 0.2,
        "limits": "",
    }
    asked = {"horizon": 40.0, "seed": 3, "least": 1, "most": 1, "seconds": 0.0}
    options = {"profile": NAME, "folders": [], "overrides": [], "parameters": {}}
    return {**options, "plan": plan.to_json(), **state, **known, **asked, **words}


def simulate(**words: object) -> tuple[dict, list[dict]]:
    runs: list[dict] = []
    return asyncio.run(PageJob(WORKER).run(job(**words), runs.append)), runs


@pytest.mark.heavy
def test_a_run_begins_in_the_middle_of_the_path_under_water():
    answer, (found,) = simulate()
    assert answer["ok"], answer
    assert answer["runs"] == 1
    first, last = found["rows"][0], found["rows"][-1]
    assert first[0] == pytest.approx(0.0, abs=0.2)
    assert first[3] == pytest.approx(2.0, abs=0.2)
    assert first[4] == pytest.approx(80.0, abs=0.3)
    assert min(row[3] for row in found["rows"]) > 1.2  # it stays down
    assert last[0] == pytest.approx(40.0, abs=1.0)
    assert last[1] > first[1] + 1e-4  # 20 m north, then east
    assert (found["seconds"], found["outcome"]) == (None, "")


@pytest.mark.heavy
def test_a_run_begins_at_any_depth_and_its_navigation_contradicts_nothing():
    answer, (found,) = simulate(depth=4.0, horizon=20.0)
    assert answer["ok"], answer
    assert (found["crossed"], found["seconds"]) == ([], None)
    assert found["rows"][0][3] == pytest.approx(4.0, abs=0.3)


@pytest.mark.heavy
@pytest.mark.parametrize(
    "options",
    [
        {"overrides": ["General:Battery Capacity=20"]},
        {"parameters": {"Simulators.Battery": {"Hotel Load": "2000"}, "Transports.Unknown": {"Rate": "1"}}},
    ],
)
def test_the_options_and_parameters_of_the_running_vehicle_count(options):
    answer, (found,) = simulate(**options)
    assert answer["ok"], answer
    assert found["rows"][0][4] - found["battery"] > 0.5, found


@pytest.mark.heavy
def test_over_a_network_a_forecast_has_the_parameters_that_the_vehicle_has_now(tmp_path):
    async def read() -> dict[str, dict[str, str]]:
        async with make_network() as network:
            vehicle = AsyncRemoteVehicle(network, await network.find_system(NAME))
            await vehicle.param.set("Depth Sensor", {"Standard Deviation": "0.03"})
            return await _parameters(vehicle)

    with running(tmp_path, "--set", "Simulators.GPS:HDOP=3"):
        found = asyncio.run(read())
    assert float(found["Simulators.GPS"]["HDOP"]) == 3.0
    assert float(found["Simulators.DepthSensor"]["Standard Deviation"]) == 0.03
    answer, _ = simulate(parameters=found, horizon=10.0)
    assert answer["ok"], answer


@pytest.mark.heavy
def test_limits_of_the_running_vehicle_count_and_a_plan_that_it_would_reject_is_refused():
    limits = imc.OperationalLimits(mask=imc.OpLimitsMask.MAX_DEPTH, max_depth=1.5)
    answer, runs = simulate(limits=limits.to_json())
    shown = [answer["text"]] if not answer["ok"] else runs[0]["crossed"]
    assert any("depth" in text for text in shown), (answer, runs)
    answer, runs = simulate(plan=sequential_plan("p", {"land": imc.Land(lat=LAT, lon=LON)}).to_json())
    assert (answer["ok"], runs) == (False, [])
    assert answer["text"].startswith("the simulated vehicle does not carry out the rest of the plan: ")


@pytest.mark.heavy
def test_an_aircraft_begins_at_its_altitude_and_with_its_battery():
    way = {"z": 30.0, "z_units": imc.ZUnits.ALTITUDE, "speed": 5.0, "speed_units": imc.SpeedUnits.METERS_PS}
    north = displace(LAT, LON, 0.0, 150.0, 0.0)[:2]
    plan = sequential_plan("p", {"north": imc.Goto(lat=north[0], lon=north[1], **way)})
    place = [math.degrees(LAT), math.degrees(LON)]
    answer, (found,) = simulate(profile="hexa-00", plan=plan.to_json(), place=place, altitude=25.0, horizon=60.0)
    assert answer["ok"], answer
    first, last = found["rows"][0], found["rows"][-1]
    assert (first[0], first[3]) == (pytest.approx(0.0, abs=0.2), pytest.approx(-25.0, abs=2.0))
    assert first[1] == pytest.approx(place[0], abs=5e-5)
    assert first[4] == pytest.approx(80.0, abs=0.3)
    assert last[3] == pytest.approx(-30.0, abs=2.0)
    assert last[1] == pytest.approx(math.degrees(north[0]), abs=1e-4)
    assert last[4] < first[4]
    assert (found["outcome"], found["crossed"]) == ("completed", [])


def posted(words: dict, user: User = ANNA) -> Request:
    async def receive() -> dict:
        return {"type": "http.request", "body": json.dumps(words).encode()}

    return Request({"type": "http", "headers": [], "state": {"user": user}}, receive)


def test_the_forecast_of_another_user_is_joined_and_replaced_only_by_who_may_maintain():
    async def answers() -> list[tuple[bool, str]]:
        radio = Radio()
        async with Network([radio]) as network:
            radio.bring(imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, src=0x1A))
            routes = ForecastRoutes(network)
            start, found = routes.orders["/api/forecast"], []
            for user, horizon in ((ANNA, 300.0), (BEN, 300.0), (BEN, 20.0), (ANNA, 30.0), (CARL, 40.0)):
                answer = json.loads((await start(posted({"vehicle": NAME, "horizon": horizon}, user))).body)
                found.append((answer["ok"], answer["text"]))
            routes.close()
        return found

    refused = f"anna has another forecast made, of {NAME}: wait until nobody looks at it"
    assert asyncio.run(answers()) == [(True, ""), (True, ""), (False, refused), (True, ""), (True, "")]


def test_of_two_forecasts_that_are_started_at_once_one_is_made():
    async def running() -> list[str]:
        radio = Radio()
        async with Network([radio]) as network:
            radio.bring(imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, src=0x1A))
            routes = ForecastRoutes(network)
            start = routes.orders["/api/forecast"]
            await start(posted({"vehicle": NAME}))
            await asyncio.sleep(0)
            await asyncio.gather(*(start(posted({"vehicle": NAME, "horizon": each})) for each in (20.0, 30.0)))
            found = [task.get_coro().__qualname__ for task in asyncio.all_tasks()]
            routes.close()
        return [name for name in found if name == "ForecastRoutes._repeat"]

    assert len(asyncio.run(running())) == 1


def test_a_forecast_is_off_on_a_vehicle_unless_its_option_is_set(tmp_path):
    with vehicle_page(tmp_path) as page:
        page.log_in()
        found = page.get(f"/api/forecast?vehicle={NAME}")
        assert (found["allowed"], found["on"]) == (False, False)
        status, content, _ = page.request("POST", "/api/forecast", {"vehicle": NAME})
        assert (status, json.loads(content)["ok"]) == (200, False)
        assert "[Transports.Console] Forecast" in json.loads(content)["text"]


@pytest.mark.heavy
def test_a_running_plan_is_forecast_while_somebody_asks(tmp_path):
    with vehicle_page(tmp_path, "--set", "Transports.Console:Forecast=true") as page:
        page.log_in()

        def begin(**words: object) -> dict:
            return json.loads(page.request("POST", "/api/forecast", {"vehicle": NAME, **words})[1])

        def asked() -> dict:
            return page.get(f"/api/forecast?vehicle={NAME}")

        with page.frames():
            for words in ({"horizon": "x"}, {"horizon": 1e9}, {"current": math.inf}, {"vehicle": "nobody"}):
                assert not begin(**words)["ok"]
            until(lambda: page.order(NAME, "put", text=PLAN)["ok"], 30.0)
            assert begin(horizon=20)["ok"]
            until(lambda: "no plan is running" in asked()["text"], 10.0)
            until(lambda: page.order(NAME, "start", plan="square")["ok"], 60.0)
            found = until(lambda: answer if "summary" in (answer := asked()) else None, 120.0)
        assert found["summary"].startswith("1 run to 20 s; ")
        assert len(found["tracks"]) == 1
        assert found["circles"][0]["runs"] == 1
