"""What [General] sets for all links to consoles, over UDP and TCP."""

import ftplib
import time

import pytest

import imc
from runtime.profile import load_profile
from runtime.vehicle import check_profile
from tests.tasks.transports.imc_station import Station, afloat
from tests.tasks.transports.tcp.peers import Peer, packet

PORT = "Transports.TCP.Server:Port=0"
START = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="nothing", dst=0x001A)


def tcp_peer(vessel):
    return Peer.of(vessel.vehicle.task("Transports.TCP.Server").open_port)


@pytest.mark.heavy
def test_one_list_of_consoles_holds_for_udp_and_tcp(tmp_path):
    with afloat(tmp_path, "General:Consoles=0x4101@127.0.0.1, 0x4999@10.0.0.5", PORT) as vessel:
        requests = vessel.hears(imc.PlanControl)
        for number, system in enumerate((0x4042, 0x4999, 0x4101)):
            Station(vessel, system=system).join().send(START.replace(request_id=number))
            tcp_peer(vessel).send(packet(START.replace(request_id=10 + number), system))
        vessel.until(lambda: {2, 12} <= {r.request_id for r in requests})
        time.sleep(0.2)
        assert {(r.src, r.request_id) for r in requests if r.type == r.Type.REQUEST} == {(0x4101, 2), (0x4101, 12)}
        vessel.until(lambda: len([t for t in vessel.log if "command of a console that is not listed" in t]) == 4)


@pytest.mark.heavy
def test_logs_are_removed_over_ftp_only_from_addresses_in_the_list(tmp_path):
    settings = ["Transports.FTP:Allow Deletion=true", "Transports.FTP:Control Port=0"]
    for listed, answer in (("0x4101@10.0.0.5", "550"), ("0x4101", "550"), ("mavlink:255@127.0.0.1", "250")):
        old = tmp_path / "lauv-noptilus-1" / "20260101"
        old.mkdir(parents=True, exist_ok=True)
        with afloat(tmp_path, *settings, f"General:Consoles={listed}") as vessel, ftplib.FTP(timeout=10) as client:
            server = vessel.vehicle.task("Transports.FTP")
            client.connect("127.0.0.1", vessel.until(lambda server=server: server.port))
            client.login()
            assert "20260101" in client.nlst()
            client.putcmd("DELE /20260101")
            said = client.getmultiline()
        assert said.startswith(answer), (listed, said)
        assert old.exists() == (answer == "550")


def test_a_link_may_have_a_list_of_its_own(tmp_path):
    settings = "General:Consoles=0x4101", "Transports.TCP.Server:Consoles=0x4042", PORT
    with afloat(tmp_path, *settings) as vessel:
        assert set(vessel.udp.commanders.listed) == {0x4101}
        assert set(vessel.vehicle.task("Transports.TCP.Server").commanders.listed) == {0x4042}


def test_sightings_reach_consoles_over_each_link_of_a_shipped_vehicle(tmp_path):
    with afloat(tmp_path, PORT) as vessel:
        over_udp, over_tcp = Station(vessel).join(), tcp_peer(vessel)
        over_udp.get(imc.EstimatedState)
        over_tcp.send(packet(imc.Heartbeat()))
        vessel.until(lambda: over_tcp.of_type(imc.EstimatedState))
        sighting = imc.EstimatedMugState(id=3, x=1.0, y=2.0)
        vessel.vehicle.kernel.post(vessel.udp.publish, sighting)
        assert over_udp.get(imc.EstimatedMugState).id == 3
        vessel.until(lambda: over_tcp.of_type(imc.EstimatedMugState))


def test_a_message_for_all_links_may_have_a_rate(tmp_path):
    with afloat(tmp_path, "General:Console Messages=Depth, Pressure:1", PORT) as vessel:
        for task in (vessel.udp, vessel.vehicle.task("Transports.TCP.Server")):
            depth, pressure = (kind(src=0x001A, dst=0xFFFF) for kind in (imc.Depth, imc.Pressure))
            assert [task.messages.passes(depth, 100.0 + i) for i in (0.0, 0.1, 0.2)] == [True] * 3
            assert [task.messages.passes(pressure, 100.0 + i) for i in (0.0, 0.1, 1.0)] == [True, False, True]


def test_a_misspelled_message_for_all_links_is_reported():
    profile = load_profile("otter", overrides=["General:Console Messages=EstimatedMugStat, Depth:2"])
    (problem,) = [p for p in check_profile(profile, {}) if "Console Messages" in p.text]
    assert "there is no message 'EstimatedMugStat'" in problem.text
    assert "EstimatedMugState" in problem.hint
