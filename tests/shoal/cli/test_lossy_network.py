"""What the commands say of a shipped vehicle over a network that loses packets: silence is not no."""

import json
import random
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

import imc
from shoal.network import Network, NetworkLink, ReceivedPacket, connect
from tests.command import shoal
from tests.outside import until
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    with running(tmp_path_factory.mktemp("vehicle"), network="udp") as found:
        until(lambda: shoal("plan", NAME, "status").exit_code == 0, 30.0)
        yield found


def lose(monkeypatch: pytest.MonkeyPatch, share: float, *kinds: type[imc.Message], of: int = -1) -> None:
    """Lose a share of the packets of some types, of one entity if it is given."""
    chance, receive = random.Random(3), Network.on_packet

    def on_packet(network: Network, link: NetworkLink, arrival: ReceivedPacket) -> None:
        message = network.messages.decode(arrival.packet)
        ours = isinstance(message, kinds) and of in (-1, message.src_ent)
        if not ours or chance.random() >= share:
            receive(network, link, arrival)

    monkeypatch.setattr(Network, "on_packet", on_packet)


def rows(*words: str) -> Any:
    result = shoal(*words)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


@pytest.mark.heavy
def test_all_entities_are_listed_over_a_lossy_network_or_the_missing_ones_are_named(
    process: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    everything = rows("param", NAME, "list", "--json")
    assert len(everything) > 50
    with monkeypatch.context() as patch:
        lose(patch, 0.5, imc.EntityParameters)
        assert rows("param", NAME, "list", "--json").keys() == everything.keys()
    with monkeypatch.context() as patch:
        patch.setattr("shoal.network.parameters.ROUNDS", 3)
        gps = entity_id(NAME, "GPS")
        lose(patch, 1.0, imc.EntityParameters, of=gps)
        result = shoal("param", NAME, "list", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout).keys() == everything.keys() - {"GPS"}
    assert "no answer from 1 entities (GPS)" in result.stderr


@pytest.mark.heavy
def test_an_entity_whose_answers_are_lost_may_have_parameters(process: object, monkeypatch: pytest.MonkeyPatch) -> None:
    lose(monkeypatch, 1.0, imc.EntityParameters)
    result = shoal("param", NAME, "set", "GPS:Latency=0.1")
    assert result.exit_code == 1
    assert "GPS does not answer: it has no parameters, or " in result.stderr


@pytest.mark.heavy
def test_an_entity_without_parameters_says_so(process: object) -> None:
    with connect(NAME) as vehicle:
        entity = min(vehicle.param.entity_ids().keys() - vehicle.param.list().keys())
    result = shoal("param", NAME, "get", entity)
    assert result.exit_code == 1
    assert f"{entity} has no parameters" in result.stderr


@pytest.mark.heavy
def test_rates_name_each_entity_once_and_count_from_the_first_message(
    process: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    lose(monkeypatch, 0.8, imc.EntityList, imc.EntityInfo)
    found = rows("spy", NAME, "EntityState", "Heartbeat", "EstimatedState", "--hz", "--json")
    places = Counter((row["message"], row["entity"]) for row in found)
    assert set(places.values()) == {1}
    assert not [row["entity"] for row in found if row["entity"].isdecimal()]
    first = next(row for row in found if row["message"] == "EntityState")
    assert first["hz"] == pytest.approx(first["count"] / 3.0, rel=0.2)  # the window begins with the first message


@pytest.mark.heavy
def test_a_vehicle_that_has_not_said_how_it_is_is_not_without_errors(
    process: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    lose(monkeypatch, 1.0, imc.EntityState, imc.VehicleState)
    (found,) = rows("ls", "--json")
    assert found["errors"] is None
    assert found["mode"] is None


def entity_id(name: str, label: str) -> int:
    """The id of an entity, as the vehicle says."""
    with connect(name) as vehicle:
        return vehicle.param.entity_ids()[label]
