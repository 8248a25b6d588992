"""What shipped vehicles tell and do when ground stations ask: the true vehicle is the judge."""

import math

import pytest

import imc
from mavlink import encode, split
from tests.tasks.transports.mavlink_station import deliver
from tests.tasks.transports.test_mavlink_manual import DIALECT, Helmsman
from tests.tasks.transports.test_mavlink_vehicles import Commanded, commanded

SHIPPED = {"lauv-noptilus-1": -3.0, "otter": 0.0, "hexa-00": 15.0}
ACCEPTED, DENIED, INVALID = 0, 2, 5
GPS, FENCE = 0x20, 0x100000
LAT, LON = 41.185, -8.7062


def e7(north, east):
    """A place in 1e-7 degrees, some meters north and east of where vehicles begin."""
    return round((LAT + north / 111_050) * 1e7), round((LON + east / 83_900) * 1e7)


class Console(Helmsman):
    """A ground station that uploads, orders and asks."""

    def __init__(self, flown, flavor="generic"):
        super().__init__(flown, flavor)

    def hears(self, seconds):
        """What came in these seconds, by name."""
        self.flown.vehicle.run(seconds)
        found = {}
        for frame in self.frames:
            for message in split(frame, DIALECT)[0]:
                found.setdefault(message.name, []).append(message.values)
        self.frames.clear()
        return found

    def request(self, number):
        self.say("COMMAND_LONG", target_system=self.mine, command=512, param1=number)
        return self.hears(0.2)

    def current(self):
        return self.request(42)["MISSION_CURRENT"][-1]

    def upload(self, *places, z):
        """Upload waypoints; the answer and the texts."""
        self.say("MISSION_COUNT", target_system=self.mine, count=len(places))
        texts = []
        while True:
            heard = self.hears(0.1)
            texts += [text["text"].decode().rstrip("\0") for text in heard.get("STATUSTEXT", ())]
            if "MISSION_ACK" in heard:
                more = self.hears(0.5).get("STATUSTEXT", ())
                texts += [text["text"].decode().rstrip("\0") for text in more]
                return heard["MISSION_ACK"][0]["type"], "".join(texts)
            for request in heard["MISSION_REQUEST_INT"]:
                x, y = e7(*places[request["seq"]])
                item = dict(seq=request["seq"], frame=6, command=16, autocontinue=1, x=x, y=y, z=z)
                self.say("MISSION_ITEM_INT", target_system=self.mine, **item)

    def go(self, north, east, z, frame=6):
        x, y = e7(north, east)
        self.say("COMMAND_INT", target_system=self.mine, command=192, frame=frame, param1=-1.0, x=x, y=y, z=z)
        return self.hears(1.0)["COMMAND_ACK"][-1]["result"]


@pytest.fixture(params=SHIPPED)
def flown(request, tmp_path):
    with commanded(request.param, tmp_path) as found:
        found.z = SHIPPED[request.param]
        yield found


def away(flown, north, east):
    truth = flown.truths[-1]
    return math.hypot(truth.x - north, truth.y - east)


def test_there_is_no_home_before_the_navigation_is_aligned(tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(2.0)
    assert flown.link.endpoint.model.latest.state is not None, "the estimate of a place that was told by hand"
    console = Console(flown)
    heard = {number: console.request(number) for number in (242, 33, 32, 1)}
    assert [heard[n]["COMMAND_ACK"][0]["result"] for n in (242, 33, 32)] == [1, 1, 1]
    assert not heard[1]["SYS_STATUS"][0]["onboard_control_sensors_health"] & GPS
    flown.vehicle.run(10.0)
    assert "HOME_POSITION" in console.request(242)
    assert console.request(1)["SYS_STATUS"][0]["onboard_control_sensors_health"] & GPS
    flown.vehicle.close()


@pytest.mark.heavy
def test_set_current_of_mavsdk_and_mission_planner_makes_the_vehicle_jump(flown):
    console = Console(flown)
    assert console.upload((90, 0), (90, 60), (0, 60), z=flown.z)[0] == ACCEPTED
    assert console.order(command=300) == ACCEPTED
    flown.vehicle.run(5.0)
    assert console.current()["seq"] == 0
    console.say("MISSION_SET_CURRENT", target_system=console.mine, seq=2)
    flown.vehicle.run(1.0)
    assert console.current()["seq"] == 2
    assert flown.link.endpoint.mission._maneuver == "Goto2"
    flown.until(lambda: console.current()["mission_state"] == 5, 100.0)
    assert away(flown, 0, 60) < 20.0
    assert console.current()["mission_state"] == 5
    reached = []
    flown.link.endpoint.mission._reach = reached.extend
    assert console.order(command=20) == ACCEPTED
    flown.vehicle.run(2.0)
    assert console.current()["mission_state"] == 5, "what is complete is not paused by a return"
    assert reached == []


@pytest.mark.heavy
def test_a_mission_that_was_paused_goes_on_where_it_was_and_an_order_to_continue_does_not_restart_it(flown):
    console, mission = Console(flown), flown.link.endpoint.mission
    console.upload((30, 0), (30, 60), (0, 60), z=flown.z)
    assert console.order(command=300) == ACCEPTED
    for _ in range(60):
        flown.vehicle.run(1.0 if mission._maneuver != "Goto1" else 0.0)
    assert console.current()["seq"] == 1
    assert console.order(0, command=193) == ACCEPTED
    flown.vehicle.run(3.0)
    assert (console.current()["seq"], console.current()["mission_state"]) == (1, 4)
    for command in (193, 193, 300):  # MAVSDK repeats an order without counting
        assert console.order(1 if command == 193 else 0, command=command) == ACCEPTED
        flown.vehicle.run(0.5)
        assert (console.current()["seq"], mission._maneuver) == (1, "Goto1")
    assert console.order(0, command=224) == ACCEPTED
    flown.vehicle.run(1.0)
    assert (console.current()["seq"], mission._maneuver) == (0, "Goto0")


def test_items_that_were_jumped_over_are_not_reached(flown):
    console, reached = Console(flown), []
    console.upload((90, 0), (20, 0), (0, 60), z=flown.z)
    flown.link.endpoint.mission._reach = reached.extend
    console.order(command=300)
    flown.vehicle.run(5.0)
    assert console.order(1, command=224) == ACCEPTED
    flown.until(lambda: reached, 60.0)
    assert reached[:1] == [1]


@pytest.mark.heavy
def test_a_mission_that_is_uploaded_in_flight_is_not_flown_until_it_is_started(flown):
    console = Console(flown)
    console.upload((90, 0), z=flown.z)
    console.order(command=300)
    flown.vehicle.run(5.0)
    result, texts = console.upload((0, 90), (90, 90), z=flown.z)
    assert result == ACCEPTED
    assert "The vehicle continues the mission before this one" in texts
    flown.vehicle.run(2.0)
    assert (console.current()["mission_state"], flown.modes[-1]) == (2, "MISSION")
    by_mode = flown.profile == "otter"  # as MAVSDK starts missions
    assert (console.order(1, 4, 4, command=176) if by_mode else console.order(command=300)) == ACCEPTED
    flown.until(lambda: away(flown, 0, 90) < 45.0, 90.0)
    assert console.current()["mission_state"] == 3
    assert away(flown, 0, 90) < 45.0


def test_what_cannot_be_started_is_reported_at_the_upload(flown):
    console = Console(flown)
    result, texts = console.upload((60_000, 0), z=flown.z)
    assert result == ACCEPTED, "the vehicle may still be on its way there"
    assert "but cannot be started now: Goto0: a leg of " in texts
    lat, lon = math.radians(LAT), math.radians(LON)
    flown.say(imc.OperationalLimits(mask=imc.OpLimitsMask.AREA, lat=lat, lon=lon, length=200.0, width=200.0))
    flown.vehicle.run(1.0)
    result, texts = console.upload((10, 0), (101, 0), z=flown.z)
    assert result == INVALID
    assert "item 1 (NAV_WAYPOINT): is outside the fence, the area of the operational limits" in texts


@pytest.mark.heavy
def test_an_abort_is_an_emergency(flown):
    console = Console(flown)
    console.upload((90, 0), z=flown.z)
    console.order(command=300)
    flown.vehicle.run(10.0)
    console.say("COMMAND_LONG", target_system=console.mine, command=185, param1=1)
    flown.vehicle.run(0.5)
    assert (0, "Abort") in flown.link.endpoint.model.notices
    assert console.request(0)["HEARTBEAT"][0]["system_status"] == 6
    flown.until(lambda: console.request(0)["HEARTBEAT"][0]["system_status"] in (3, 4), 60.0)
    assert console.request(0)["HEARTBEAT"][0]["system_status"] in (3, 4)
    assert flown.modes[-1] == "MANUAL"


@pytest.mark.heavy
@pytest.mark.computing
def test_a_new_speed_is_that_of_the_way_that_it_is_on(flown):
    console = Console(flown)
    if flown.profile == "hexa-00":
        assert console.order(0, 0, 0, 0, 0, 0, 12, command=22) == ACCEPTED
        flown.vehicle.run(20.0)
    assert console.go(300, 0, flown.z) == ACCEPTED
    fast, slow = (1.8, 0.9) if flown.profile != "hexa-00" else (6.0, 2.0)
    seen = []
    for speed in (fast, slow):
        assert console.order(0, speed, command=178) == ACCEPTED
        flown.vehicle.run(15.0)
        before = flown.truths[-1]
        flown.vehicle.run(10.0)
        seen.append(away(flown, before.x, before.y) / 10.0)
    assert seen == pytest.approx([fast, slow], abs=0.35)
    assert console.order(0, 40, command=178) == DENIED
    assert console.order(0, -1, command=178) == ACCEPTED
    assert flown.modes[-1] == "GUIDED"


def test_home_is_set_as_in_ardupilot(flown):
    console = Console(flown)
    system = flown.link.endpoint.model
    first = system.home
    assert console.order(0, 0, 0, 0, 50.0, 10.0, 10.0, command=179) == DENIED, "1700 km away"
    assert system.home == first
    x, y = e7(30, 0)
    console.say("COMMAND_INT", target_system=console.mine, command=179, frame=3, x=x, y=y, z=0.0)
    assert console.hears(0.2)["COMMAND_ACK"][0]["result"] == ACCEPTED
    assert math.degrees(system.home.lat) == pytest.approx(x / 1e7)
    assert system.home.altitude == pytest.approx(first.altitude, abs=0.1), "0 m above what was home"
    assert console.order(0, 0, 0, 0, 0, 0, 0, command=179) == ACCEPTED
    place = system.state_and_position()[1]
    assert (system.home.lat, system.home.lon) == pytest.approx((place.lat, place.lon), abs=1e-6)


def test_a_boat_may_be_sent_to_the_altitude_that_it_shows(tmp_path):
    flown = Commanded("otter", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    console = Console(flown)
    assert console.go(40, 0, -0.03, frame=0) == ACCEPTED
    assert console.go(40, 0, -3.0, frame=0) == DENIED
    flown.vehicle.close()


@pytest.mark.heavy
def test_px4_takes_off_to_an_altitude_above_the_sea(tmp_path):
    flown = Commanded("hexa-00", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    for flavor, altitude, expected in (("px4", 10.0, DENIED), ("px4", 94.6, ACCEPTED)):
        console = Console(flown, flavor)
        assert console.order(0, 0, 0, 0, 0, 0, altitude, command=22) == expected
    flown.vehicle.run(6.0)
    assert flown.truths[-1].z < -1.0
    assert console.order(0, 0, 0, 0, 0, 0, altitude, command=22) == expected, "MAVSDK repeats it without counting"
    flown.vehicle.run(19.0)
    assert console.order(0, 0, 0, 0, 0, 0, altitude, command=22) == DENIED
    assert flown.truths[-1].z == pytest.approx(-10.0, abs=1.5)
    flown.vehicle.close()


@pytest.mark.heavy
@pytest.mark.computing
def test_mission_planner_and_mavproxy_send_items_as_orders(flown):
    console = Console(flown, "ardupilot")
    if flown.profile == "hexa-00":
        assert console.order(0, 0, 0, 0, 0, 0, 12, command=22) == ACCEPTED
        flown.vehicle.run(20.0)
    x, y = e7(40, 20)
    item = dict(target_system=console.mine, frame=6, command=16, autocontinue=1)
    console.say("MISSION_ITEM_INT", **item, current=2, x=x, y=y, z=flown.z)
    assert console.hears(1.0)["MISSION_ACK"][0]["type"] == ACCEPTED
    assert flown.modes[-1] == "GUIDED"
    flown.until(lambda: away(flown, 40, 20) < 16.0, 70.0)
    assert away(flown, 40, 20) < 16.0
    console.say("MISSION_ITEM", **{**item, "frame": 3}, current=3, z=flown.z * 1.5)
    assert console.hears(1.0)["MISSION_ACK"][0]["type"] == ACCEPTED
    flown.vehicle.run(40.0)
    assert away(flown, 40, 20) < 35.0, "only the altitude changes"
    assert -flown.truths[-1].z == pytest.approx(flown.z * 1.5, abs=1.0)
    console.say("MISSION_ITEM_INT", **item, current=2, x=x, y=y, z=math.nan if flown.profile != "otter" else -9.0)
    console.hears(1.0)
    assert console.current()["mission_state"] == 1, "it is no mission"


@pytest.mark.heavy
def test_qgroundcontrol_changes_the_altitude_of_a_copter_by_a_target(tmp_path):
    flown = Commanded("hexa-00", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    console = Console(flown, "ardupilot")
    assert console.order(1, 4) == ACCEPTED
    assert console.order(0, 0, 0, 0, 0, 0, 12, command=22) == ACCEPTED
    flown.vehicle.run(20.0)
    target = dict(target_system=console.mine, coordinate_frame=7, type_mask=0xFFF8)
    console.say("SET_POSITION_TARGET_LOCAL_NED", **target, z=-6.0)
    flown.vehicle.run(20.0)
    assert flown.truths[-1].z == pytest.approx(-18.0, abs=1.5)
    flown.vehicle.close()


def test_other_vehicles_do_not_hide_that_the_stations_are_lost(tmp_path):
    flown = Commanded("otter", tmp_path, gcs_timeout=15.0, gcs_action="Return")
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    console = Console(flown)

    def hear(name, **fields):
        definition = DIALECT.by_name[name]
        (message,), _ = split(encode(definition, definition.pack(fields), 0, 7, 1), DIALECT)
        deliver(flown.link, console.session, message)

    assert console.go(300, 0, 0.0) == ACCEPTED
    hear("PING", target_system=console.mine)
    for _ in range(20):
        hear("HEARTBEAT", type=11, autopilot=3)
        hear("ATTITUDE", yaw=1.0)
        flown.vehicle.run(1.0)
    assert flown.modes[-1] == "RETURN"
    flown.vehicle.close()


def test_a_vehicle_outside_its_fence_says_so(tmp_path):
    flown = Commanded("otter", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    console = Console(flown)
    lat, lon = math.radians(LAT), math.radians(LON)
    area = imc.OperationalLimits(mask=imc.OpLimitsMask.AREA, lat=lat, lon=lon, length=200.0, width=200.0)
    for limits, health in ((area.replace(mask=0), 0), (area, FENCE), (area.replace(lat=lat + 1e-4), 0)):
        flown.say(limits)
        flown.vehicle.run(0.5)
        status = console.request(1)["SYS_STATUS"][0]
        assert status["onboard_control_sensors_present"] & FENCE == (FENCE if limits.mask else 0)
        assert status["onboard_control_sensors_health"] & FENCE == (health if limits.mask else FENCE)
    flown.vehicle.close()
