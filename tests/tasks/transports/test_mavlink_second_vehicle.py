"""Shipped vehicles beside each other on one computer: ground stations reach both."""

import pytest

from runtime import State
from tests.tasks.transports.imc_station import afloat


def links(vessel):
    task = vessel.vehicle.task("Transports.MAVLink")
    vessel.until(lambda: getattr(task, "link_set", None) and all(link.is_open for link in task.link_set.links))
    return task.link_set.links


@pytest.mark.parametrize("more", ["", ", tcpin://127.0.0.1"])
def test_a_second_vehicle_listens_at_another_port_and_logs_it(tmp_path, more):
    settings = ["Transports.MAVLink:Enabled=Simulation", "Transports.TCP.Server:Port=0"]
    if more:
        settings.append(f"Transports.MAVLink:Links=udpin://127.0.0.1:14551{more}")
    with (
        afloat(tmp_path / "a", *settings) as first,
        afloat(tmp_path / "b", *settings, profile="hexa-00") as second,
    ):
        places = [{link.url.address for link in links(each) if link.url.listens} for each in (first, second)]
        assert places[0].isdisjoint(places[1])
        for _, port in places[1]:
            second.logged(
                f"is taken: ground stations connect to {'tcpin' if port < 14000 else 'udpin'}://127.0.0.1:{port}"
            )
        for each in (first, second):
            each.until(lambda each=each: each.vehicle.task("Transports.MAVLink").entity.state is State.NORMAL)
