"""A request by GET changes nothing on a vehicle."""

import asyncio
import json
import re
import time
from types import SimpleNamespace
from urllib.parse import urlencode

import pytest

import imc
from shoal.console import ConsoleServer
from shoal.console.health.dive_check_routes import DiveCheckRoutes
from shoal.network import ConsoleIdentity, LinkListener, Network
from shoal.network.query_messages import is_query
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.page_of_nobody import served_page
from tests.shoal.console.page_routes import routes_of

NAME = "lauv-noptilus-1"
WORDS = {"vehicle": NAME, "entity": "CTD", "plan": "east", "camera": "1", "number": "1", "log": "a", "file": "b"}
PLAN = imc.PlanDBInformation(plan_id="east")
NAMED = re.compile(r"{\w+}")


class RecordingVehicle(Radio):
    """A vehicle that keeps what it is sent, and answers with the list of its plans only."""

    def __init__(self) -> None:
        self.sent: list[imc.Message] = []

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        await super().open(listener, console)
        self.loop = asyncio.get_running_loop()

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        self.sent.append(message)
        if isinstance(message, imc.PlanDB) and message.op == imc.PlanDB.Op.GET_STATE:
            success, state = imc.PlanDB.Type.SUCCESS, imc.PlanDBState(plan_count=1, plans_info=[PLAN])
            answer = message.replace(type=success, arg=state, src=0x1A, dst=imc.header(packet).src)
            asyncio.get_running_loop().call_soon(self.bring, answer)


async def ask(server: ConsoleServer, method: str, path: str) -> int:
    """The status of the answer to a request of a user who may do everything."""
    host, cookie = f"127.0.0.1:{server.port}", f"shoal-console-{server.port}={server._access.login(link_token(server))}"
    headers = [(b"host", host.encode()), (b"cookie", cookie.encode()), (b"origin", f"http://{host}".encode())]
    scope = {"type": "http", "method": method, "path": path, "query_string": urlencode(WORDS).encode()}
    status = []

    async def receive() -> dict:
        return {"type": "http.request", "body": b"{}"}

    async def send(message: dict) -> None:
        if message["type"] == "http.response.start":
            status.append(message["status"])

    await server._server.config.app({**scope, "headers": headers, "scheme": "http"}, receive, send)
    return status[0]


def link_token(server: ConsoleServer) -> str:
    server._access._logins._buckets.clear()
    return server.login_link().partition("#")[2]


def test_a_request_by_get_sends_the_vehicle_questions_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async def run() -> list[imc.Message]:
        vehicle = RecordingVehicle()
        async with Network([vehicle]) as network:
            vehicle.bring(imc.Heartbeat(src=0x1A), imc.PlanControlState(src=0x1A))
            server = ConsoleServer(network)
            paths = [NAMED.sub("1", path) for method, path in routes_of(server) if method == "GET"]
            statuses = await asyncio.gather(*(ask(server, "GET", path) for path in paths))
            assert len(paths) > 20
            assert all(status < 500 for status in statuses), dict(zip(paths, statuses, strict=True))
            server._socket.close()
        return vehicle.sent

    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 0.3)
    monkeypatch.setattr("shoal.console.charts.map_routes.PATIENCE", 0.3)
    sent = asyncio.run(run())
    kinds = {type(each) for each in sent}
    assert {imc.PlanDB, imc.GetOperationalLimits, imc.EntityList} <= kinds
    assert {type(each) for each in sent if not is_query(each)} == {imc.ImageTxSettings}, "a picture is asked for"


@pytest.mark.parametrize("refusal", ["anna may watch: this needs the role operate", ""])
def test_a_vehicle_checks_a_plan_only_for_who_may_operate(monkeypatch: pytest.MonkeyPatch, refusal: str) -> None:
    async def question() -> bytes:
        return json.dumps(WORDS).encode()

    async def run() -> tuple[list[imc.Message], str]:
        vehicle = RecordingVehicle()
        async with Network([vehicle]) as network:
            vehicle.bring(imc.Heartbeat(src=0x1A), imc.PlanControlState(src=0x1A))
            request = SimpleNamespace(body=question, state=SimpleNamespace(refusal=refusal))
            answer = json.loads((await DiveCheckRoutes(network)._answer(request)).body)
        assert answer["plans"] == ["east"]
        return vehicle.sent, next(each["value"] for each in answer["checks"] if each["name"] == "Plan")

    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 0.3)
    monkeypatch.setattr("shoal.console.health.dive_check_routes.PATIENCE", 0.0)
    sent, plan = asyncio.run(run())
    assert any(isinstance(each, imc.PlanControl) for each in sent) == (not refusal)
    reason = "not checked by the vehicle: anna" if refusal else f"{NAME} does not answer PlanControl"
    assert plan.startswith(f"east: unknown: {reason}")


@pytest.mark.parametrize("is_followed", [True, False])
def test_a_page_that_follows_a_vehicle_checks_it_at_once(monkeypatch: pytest.MonkeyPatch, is_followed: bool) -> None:
    """The vehicle answers for its plans only: nothing else comes, however long the page waits."""
    patience = 1.2
    monkeypatch.setattr("shoal.console.health.dive_check_routes.PATIENCE", patience)
    vehicle = RecordingVehicle()
    with served_page(vehicle) as page:
        vehicle.loop.call_soon_threadsafe(vehicle.bring, imc.Heartbeat(src=0x1A))
        page.log_in()
        with page.frames() as frames:
            while NAME not in json.loads(frames.recv(10))["vehicles"]:
                pass
            if is_followed:
                time.sleep(patience)
            began = time.monotonic()
            status, content, _ = page.request("POST", "/api/checks", {"vehicle": NAME})
            spent = time.monotonic() - began
    assert (status, json.loads(content)["plans"]) == (200, ["east"])
    assert (spent < patience) == is_followed, spent
