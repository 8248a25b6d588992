"""Parameters of a vehicle that does not answer all questions, as over a radio."""

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

import imc
from shoal.network import AsyncRemoteParameters, Network, NoAnswer, PartialAnswer, UDPLink
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.network.station import OWN, Station, discovery_ports, living


class Vehicle(Station):
    """Has a parameter, Rate of GPS. Of the answers with its value those between `lost` do not arrive."""

    def __init__(self, *, lost: range = range(0), refuses: bool = False) -> None:
        super().__init__(discovery_ports())
        self.lost, self.refuses = lost, refuses
        self.value = "1.0"
        self.sent_answers = 0

    def listen(self) -> None:
        self.heard.clear()
        super().listen()
        for message in self.heard:
            if isinstance(message, imc.EntityList) and message.dst == OWN:
                self.send(self.packet(imc.EntityList(op=imc.EntityList.Op.REPORT, list="GPS=1;Empty=2")))
            elif isinstance(message, imc.QueryEntityParameters) and message.name == "GPS":
                self.answer(Rate=self.value, Active="true")
            elif isinstance(message, imc.SetEntityParameters) and not self.refuses:
                (param,) = message.params
                assert isinstance(param, imc.EntityParameter)
                self.value = param.value + ".0"
                self.answer(Rate=self.value)

    def answer(self, **texts: str) -> None:
        values = tuple(imc.EntityParameter(name=name, value=text) for name, text in texts.items())
        if self.sent_answers not in self.lost:
            self.send(self.packet(imc.EntityParameters(name="GPS", params=values)))
        self.sent_answers += 1


def on(
    vehicle: Vehicle, act: Callable[[AsyncRemoteParameters], Coroutine[Any, Any, object]], *also: imc.Message
) -> object:
    async def run() -> object:
        packets = [vehicle.packet(message) for message in also]
        async with living(vehicle, also=packets), Network([UDPLink(ports=vehicle.ports)]) as network:
            system = await network.find_system("station")
            await network.next_message(system, imc.Heartbeat)
            async with asyncio.timeout(20.0):
                return await act(AsyncRemoteParameters(network, system))

    return asyncio.run(run())


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.parameters.SHORT", 0.3)
    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 0.6)


@pytest.mark.heavy
def test_an_entity_whose_answer_was_lost_has_its_parameters() -> None:
    assert on(Vehicle(lost=range(1)), lambda param: param.get("GPS")) == {
        "Rate": "1.0",
        "Active": "true",
    }
    with pytest.raises(NoAnswer, match="Empty does not answer: it has no parameters, or "):
        on(Vehicle(), lambda param: param.get("Empty"))


@pytest.mark.heavy
def test_a_value_whose_confirmation_was_lost_is_read_back() -> None:
    """Of the vehicle's answers the first is to a question, and two are to copies of the request."""
    assert on(Vehicle(lost=range(1, 3)), lambda param: param.set("GPS", {"Rate": 3})) == {"Rate": "3.0"}


@pytest.mark.heavy
def test_a_vehicle_that_falls_silent_has_not_refused() -> None:
    with pytest.raises(NoAnswer, match="does not answer QueryEntityParameters"):
        on(Vehicle(lost=range(1, 1000)), lambda param: param.set("GPS", {"Rate": 3}))


@pytest.mark.heavy
def test_a_request_that_is_not_answered_may_have_got_lost_whatever_is_in_the_log_book() -> None:
    with pytest.raises(NoAnswer, match=r"GPS: Rate is still '1\.0'; station does not answer SetEntityParameters"):
        on(Vehicle(refuses=True), lambda param: param.set("GPS", {"Rate": 3}), imc.LogBookEntry(text="GPS fix"))


class Chatty(Vehicle):
    """Somebody asks it again and again who its entity GPS is, and its answers go to all consoles."""

    def listen(self) -> None:
        super().listen()
        self.send(self.packet(imc.EntityInfo(id=1, label="GPS", component="Sensors.GPS", src_ent=1)))
        self.send(self.packet(imc.EntityParameters(name=f"Stranger {len(self.consoles)}{time.time_ns()}")))


@pytest.mark.heavy
def test_answers_to_questions_of_others_do_not_prolong_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.parameters.ROUNDS", 2)
    found = on(Chatty(), lambda param: param.components({"GPS": 1, "Empty": 2}))
    assert found == {"GPS": "Sensors.GPS"}
    with pytest.raises(PartialAnswer, match="no answer from 1 entities") as caught:
        on(Chatty(), lambda param: param.list())
    assert caught.value.found == {"GPS": {"Rate": "1.0", "Active": "true"}}


class NearVehicle(Radio):
    """Answers each question about parameters, and no other."""

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        if isinstance(message, imc.QueryEntityParameters):
            rate = imc.EntityParameter(name="Rate", value="1.0")
            answer = imc.EntityParameters(name=message.name, params=(rate,), src=0x1A, dst=imc.header(packet).src)
            asyncio.get_running_loop().call_soon(self.bring, answer)


def test_a_search_ends_with_the_last_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.parameters.QUIET", 60.0)
    labels = [f"Sensor {number}" for number in range(70)]

    async def run() -> dict[str, dict[str, str]]:
        vehicle = NearVehicle()
        async with Network([vehicle]) as network, asyncio.timeout(20.0):
            vehicle.bring(imc.Heartbeat(src=0x1A))
            return await AsyncRemoteParameters(network, network.systems["lauv-noptilus-1"]).read(labels)

    assert asyncio.run(run()) == {label: {"Rate": "1.0"} for label in labels}
