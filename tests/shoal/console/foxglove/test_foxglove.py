"""`shoal console` beside a shipped vehicle, with viewers of Foxglove's protocol."""

import http.client
import json
import socket
import struct
import time

import pytest
from websockets.exceptions import InvalidStatus

from tests.shoal.console.foxglove.viewer import OLD, SDK, Viewer
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
STATE = "/lauv_noptilus_1/EstimatedState/Navigation"
PLAN = 'plan: "east"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7000°, depth: 0, speed: 1.0 m/s}\n'
ORIGIN = "https://viewer.example"
pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    """A console, with the address of its operators."""
    with (
        running(tmp_path_factory.mktemp("vehicle")),
        operator_page("--foxglove", "operate", "--foxglove-origin", ORIGIN) as page,
    ):
        page.log_in()
        page.operate = next(line.split()[-1] for line in printed(page) if line.startswith("Foxglove: "))
        yield page


def printed(page):
    yield from page.lines
    while True:
        yield page.process.stdout.readline()


@pytest.fixture
def watching(console):
    """A viewer with the session's cookie, which may watch only."""
    address = f"ws://{console.host}/foxglove"
    with Viewer(address, additional_headers={"Cookie": console.cookie}) as viewer:
        yield viewer


@pytest.fixture
def operating(console):
    with Viewer(console.operate) as viewer:
        yield viewer


def fetch(console, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", console.port, timeout=30)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content, dict(answer.getheaders())


def token_of(console):
    return console.operate.partition("=")[2]


@pytest.mark.parametrize("subprotocol", [SDK, OLD])
def test_messages_come_in_the_types_that_are_advertised(console, subprotocol):
    with Viewer(console.operate, subprotocol) as viewer:
        assert viewer.connection.subprotocol == subprotocol
        topics = [STATE, f"{STATE}/location", f"{STATE}/pose", f"{STATE}/odometry", "/tf"]
        for number, topic in enumerate(topics):
            viewer.subscribe(topic, 70 + number)
        viewer.until(lambda: len({number for number, _, _ in viewer.messages}) == len(topics))
        info = viewer.of("serverInfo")[0]
        assert viewer.said[0] is info
        assert {"time", "parameters", "connectionGraph", "services"} <= set(info["capabilities"])
        found = {}
        for number, moment, data in viewer.messages:
            found.setdefault(number, (moment, viewer.decode(topics[number - 70], data)))
        moment, state = found[70]
        assert (state.header.stamp.sec, state.header.stamp.nanosec) == divmod(moment, 10**9)
        assert state.src == 0x1A
        assert found[71][1].latitude == pytest.approx(41.185, abs=0.01)
        assert found[73][1].child_frame_id == found[74][1].transforms[0].child_frame_id == "lauv_noptilus_1"
        assert abs(found[72][1].pose.position.z) < 5.0
        viewer.until(lambda: len(viewer.times) > 3)
        assert viewer.times == sorted(viewer.times)
        assert abs(viewer.times[-1] - viewer.messages[-1][1]) < 60 * 10**9


def test_the_last_message_comes_at_once_and_none_after_the_end(operating):
    topic, *_ = operating.until(lambda: [name for name in operating.channels if "/Announce/" in name])
    operating.subscribe(topic, 5)
    operating.until(lambda: operating.messages, 5.0)
    assert operating.decode(topic, operating.messages[0][2]).sys_name == NAME
    operating.subscribe(STATE, 6)
    operating.until(lambda: any(number == 6 for number, _, _ in operating.messages))
    operating.send("unsubscribe", subscriptionIds=[6])
    operating.send("unsubscribe", subscriptionIds=[77])
    operating.status("there is no subscription 77")
    operating.messages.clear()
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        operating.read(0.2)
    assert not [number for number, _, _ in operating.messages if number == 6]


def test_who_may_watch_only_sets_and_orders_nothing(watching):
    watching.until(lambda: watching.channels)
    assert "services" not in watching.of("serverInfo")[0]["capabilities"]
    watching.send_call(1, 3, b"", "json")
    watching.status("watch only: no order")
    assert watching.of("serviceCallFailure") == [
        {
            "op": "serviceCallFailure",
            "serviceId": 1,
            "callId": 3,
            "message": "this viewer may watch only: no order was sent",
        }
    ]
    name = f"{NAME}/Depth Sensor/Standard Deviation"
    watching.send("setParameters", parameters=[{"name": name, "value": 7}], id="set")
    watching.status("watch only: no parameter")
    watching.send("getParameters", parameterNames=[name], id="get")
    (answer,) = watching.until(lambda: watching.of("parameterValues"))
    assert answer["id"] == "get"
    assert answer["parameters"][0]["value"] != 7
    assert not watching.services


def test_parameters_are_read_set_and_watched(console, operating):
    name = f"{NAME}/Depth Sensor/Standard Deviation"
    with Viewer(console.operate) as other:
        other.send("subscribeParameterUpdates", parameterNames=[name])
        operating.send("getParameters", parameterNames=[], id="all")
        (answer,) = operating.until(lambda: operating.of("parameterValues"))
        values = {each["name"]: each for each in answer["parameters"]}
        assert len(values) > 100
        assert values[name]["type"] == "float64"
        operating.send("setParameters", parameters=[{"name": name, "value": 0.07}], id="set")
        other.until(lambda: [e for e in other.of("parameterValues") if e["parameters"][0]["value"] == 0.07])
        done = operating.until(lambda: [e for e in operating.of("parameterValues") if e.get("id") == "set"])
        assert done[0]["parameters"] == [{"name": name, "value": 0.07, "type": "float64"}]
    for wrong, reason in (
        ({"name": name, "value": "x"}, "Standard Deviation"),
        ({"name": name, "value": {}}, "a parameter is a number"),
        ({"name": "nobody/a/b", "value": 1}, "no such vehicle"),
        ({"name": "nobody", "value": 1}, "VEHICLE/ENTITY/PARAMETER"),
    ):
        operating.said.clear()
        operating.send("setParameters", parameters=[wrong], id="wrong")
        operating.status(reason)


def test_a_plan_is_started_and_aborted_by_services(console, operating):
    assert console.order(NAME, "put", text=PLAN)["ok"]
    _, answer = operating.call("/lauv_noptilus_1/hold", 0, b"{}")
    assert json.loads(answer) == {"success": False, "message": "local commands this vehicle: take the lease first"}
    assert console.lease(NAME, "hand over")["ok"]
    encoding, answer = operating.call("/lauv_noptilus_1/start_plan", 1, b'{"plan": "nope"}')
    assert encoding == "json"
    assert not json.loads(answer)["success"]
    plan = struct.pack("<I", 5) + b"east\0"
    encoding, answer = operating.call("/lauv_noptilus_1/start_plan", 2, b"\0\1\0\0" + plan, "cdr")
    length = struct.unpack_from("<I", answer, 8)[0]
    text = answer[12 : 12 + length - 1].decode()
    assert (encoding, answer[4], text[:26]) == ("cdr", 1, "obeyed: east is carried ou"), text
    _, answer = operating.call("/lauv_noptilus_1/abort", 3, b"{}")
    assert json.loads(answer)["success"], answer
    for number, (data, form, reason) in enumerate(
        ((b"{}", "json", "NAME"), (b"\0\1\0\0\xff\xff\xff\xff", "cdr", "string in CDR"), (b"", "xml", "cdr or json")), 4
    ):
        assert reason in operating.call("/lauv_noptilus_1/start_plan", number, data, form)["message"]
    operating.send_call(9999, 8, b"", "json")
    operating.status("there is no service 9999")


def test_the_graph_has_the_tasks_that_publish_and_consume(operating):
    operating.send("subscribeConnectionGraph")

    def published():
        updates = operating.of("connectionGraphUpdate")
        return {topic["name"]: topic["publisherIds"] for each in updates for topic in each["publishedTopics"]}

    operating.until(lambda: "." in published().get(STATE, [""])[0])
    (publisher,) = published()[STATE]
    assert publisher.startswith(f"{NAME}/Navigation.")
    subscribed = {
        t["name"]: t["subscriberIds"] for e in operating.of("connectionGraphUpdate") for t in e["subscribedTopics"]
    }
    assert f"{NAME}/Plan.Engine" in subscribed[STATE]
    assert all("." in task for task in subscribed[STATE])
    services = {t["name"] for e in operating.of("connectionGraphUpdate") for t in e["advertisedServices"]}
    assert "/lauv_noptilus_1/abort" in services


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        ("{", "not a request"),
        ("[]", "not a request"),
        ('{"op": "fly"}', "not a request"),
        ('{"op": "subscribe", "subscriptions": [{"id": 1}]}', "not a request"),
        ('{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}', "number of a subscription"),
        ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 123456}]}', "no channel"),
        ('{"op": "getParameters", "parameterNames": "x"}', "not a request"),
        ("[" * 30000, "not a request"),
        (b"", "not a binary message"),
        (b"\x01\0\0\0\0x", "publishing is not offered"),
        (b"\x02\0", "is longer"),
        (b"\x02" + b"\xff" * 12, "longer than its frame"),
        (b"\x09" * 60000, "not a binary message"),
    ],
)
def test_a_wrong_frame_is_counted_and_answered_and_others_are_served(console, watching, frame, reason):
    with Viewer(console.operate) as other:
        other.subscribe(STATE, 1)
        watching.connection.send(frame)
        found = watching.status(reason)
        assert (found["level"], found["message"][-18:]) == (2, "(rejected frame 1)")
        before = len(other.messages)
        other.until(lambda: len(other.messages) > before + 3)
        watching.send("getParameters", parameterNames=["x/y/z"], id="still")
        watching.until(lambda: watching.of("parameterValues"))


def test_connections_without_token_subprotocol_or_of_other_sites_are_rejected(console):
    bare = f"ws://{console.host}/foxglove"
    cookie = {"Cookie": console.cookie}
    for address, options, status in (
        (bare, {}, 401),
        (f"{bare}?token=wrong", {"additional_headers": cookie}, 401),
        (f"{bare}?token=", {}, 401),
        (bare, {"additional_headers": cookie, "origin": ORIGIN}, 401),  # a page of another site has no cookie's rights
        (console.operate, {"origin": "https://evil.example"}, 403),
        (console.operate, {"origin": "http://127.0.0.1:1"}, 403),
        (console.operate, {"subprotocol": "foxglove.websocket.v9"}, 400),
        (
            console.operate.replace("127.0.0.1", "evil.example"),
            {"sock": socket.create_connection(("127.0.0.1", console.port))},
            403,
        ),
    ):
        with pytest.raises(InvalidStatus) as rejected, Viewer(address, **options):
            pass
        assert rejected.value.response.status_code == status, (address, options)
    for origin in (ORIGIN, "file://", f"http://{console.host}"):
        with Viewer(console.operate, origin=origin) as viewer:
            viewer.until(lambda viewer=viewer: viewer.of("serverInfo"))


def test_the_layout_has_the_topics_of_the_vehicle_and_needs_a_token(console):
    assert fetch(console, "/layout.json")[0] == 401
    assert fetch(console, "/foxglove/counts.json?token=wrong")[0] == 401
    status, content, headers = fetch(console, f"/layout.json?token={token_of(console)}", Origin=ORIGIN)
    layout = json.loads(content)
    assert (status, headers["access-control-allow-origin"]) == (200, ORIGIN)
    assert layout["configById"]["Plot!depth"]["paths"][0]["value"] == f"{STATE}.depth"
    assert layout["configById"]["map!vehicles"]["center"]["lat"] == pytest.approx(41.185, abs=0.01)
    _, _, headers = fetch(console, f"/layout.json?token={token_of(console)}", Origin="https://evil.example")
    assert "access-control-allow-origin" not in headers
