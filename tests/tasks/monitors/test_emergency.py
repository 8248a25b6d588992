"""Text messages of a vehicle that was aborted or is out of reach."""

import math

import pytest
from flying import CCU, OWN

import imc
from runtime.testing import START, simulate
from tasks.monitors.emergency import Emergency
from tests.tasks.mission.stalling_clock import StallingClock

NUMBER = "+351000000000"
FIX = imc.GpsFix(timestamp=2.0, validity=4, lat=math.radians(41.185), lon=math.radians(-8.7062))
WATER, UNDER = imc.VehicleMedium.Medium.WATER, imc.VehicleMedium.Medium.UNDERWATER
SERVICE = imc.VehicleState(timestamp=1.0, op_mode=imc.VehicleState.OpMode.SERVICE)
EXECUTING = imc.PlanControlState(timestamp=1.0, state=imc.PlanControlState.State.EXECUTING, plan_progress=40.0)
PLACE = "00:00:02 / 41 11.100000, -8 42.372000"


def sent(*feed, seconds=70.0, number=NUMBER, **parameters):
    parameters = {"sms_recipient_number": number, "lost_communications_timeout": 60.0, **parameters}
    return simulate(Emergency, sorted(feed, key=lambda m: m.timestamp), seconds=seconds, **parameters)


def texts(run):
    return [(m.number, m.contents) for m in run.of(imc.Sms)]


def medium(kind, *times):
    return [imc.VehicleMedium(timestamp=float(time), medium=kind) for time in times or (1.0,)]


def abort(*times, dst=OWN):
    return [imc.Abort(timestamp=time, src=CCU, dst=dst) for time in times]


def test_a_message_says_where_the_vehicle_is_and_how_it_is():
    more = [imc.FuelLevel(timestamp=1.0, value=71.9, confidence=80.0), SERVICE]
    run = sent(FIX, *more, *medium(WATER))
    words = f"(T) (lauv-noptilus-1) {PLACE} / f:71 v:-1 c:80 / s: S"
    assert texts(run) == [(NUMBER, words)]
    assert [bytes(m.data) for m in run.of(imc.IridiumMsgTx)] == [words.encode()]
    assert run.of(imc.Sms)[0].timeout == 30


def test_without_a_fix_the_place_is_unknown():
    assert texts(sent(*medium(WATER)))[0][1].endswith("00:01:00 / Unknown Location / f:-1 v:-1 c:-1 / s: ?")


@pytest.mark.parametrize(
    ("feed", "active", "count"),
    [
        (medium(UNDER, *range(0, 70, 5)), True, 0),
        (medium(WATER), False, 1),
        ([*medium(WATER), EXECUTING], False, 0),
        ([*medium(WATER), EXECUTING], True, 1),
        ([*medium(WATER), *(imc.Heartbeat(timestamp=float(t), src=CCU) for t in range(0, 70, 10))], True, 0),
        ([*medium(WATER), *(imc.Heartbeat(timestamp=float(t), src=0x0801) for t in range(0, 70, 10))], True, 1),
        ([], False, 0),
    ],
    ids=["under water", "afloat", "in a plan", "in a plan, active", "console", "another vehicle", "nothing known"],
)
def test_who_is_out_of_reach_sends(feed, active, count):
    assert len(texts(sent(*feed, active=active))) == count


@pytest.mark.parametrize(("beats", "count"), [(True, 0), (False, 1)])
def test_a_process_that_stands_still_sends_no_message_for_the_console_that_it_could_not_receive(beats, count):
    received = [imc.Heartbeat(timestamp=float(t), src=CCU) for t in (*range(30), *range(231, 270))] if beats else []
    clock = StallingClock(round(START * 1e9), [(30.05, 200.0)])
    assert len(texts(sent(*medium(WATER), *received, seconds=268.0, clock=clock))) == count


STRANGE = [math.nan, math.inf, -math.inf, 1e30]


@pytest.mark.parametrize("value", STRANGE)
def test_figures_that_are_none_do_not_keep_the_message_back(value):
    fuel = imc.FuelLevel(timestamp=3.0, value=value, confidence=value)
    voltage = imc.Voltage(timestamp=3.0, value=value)
    plan = EXECUTING.replace(plan_progress=value)
    run = sent(FIX, fuel, voltage, plan, *abort(5.0), batteries="")
    assert texts(run)[0] == (NUMBER, f"(A) (lauv-noptilus-1) {PLACE} / f:-1 v:-1 c:-1 / s: ? / p:-1")


@pytest.mark.parametrize("value", [*STRANGE, 1e308, 1.6])
def test_a_fix_that_is_nowhere_on_earth_does_not_replace_the_last_place(value):
    run = sent(FIX, FIX.replace(timestamp=4.0, lat=value), *abort(5.0))
    assert f" {PLACE} /" in texts(run)[0][1]


def test_a_stranger_that_may_not_command_does_not_keep_the_vehicle_in_reach():
    beats = [imc.Heartbeat(timestamp=float(t), src=0x4999) for t in range(0, 70, 10)]
    for listed, count in (("", 0), ("0x4101", 1), ("0x4999", 0)):
        settings = {"General": {"Consoles": listed}}
        assert len(texts(sent(*medium(WATER), *beats, settings=settings))) == count


def test_an_abort_that_is_repeated_is_one_message():
    run = sent(*abort(*(5.0 + 0.1 * k for k in range(50))), *abort(1.0, dst=0x0801), seconds=20.0)
    assert [text.split()[0] for _, text in texts(run)] == ["(A)"]


def test_a_text_asks_for_the_position_and_switches_it():
    ask = [imc.TextMessage(timestamp=5.0 + k, src=OWN, dst=OWN, origin="+44", text="POS") for k in range(5)]
    stranger = imc.TextMessage(timestamp=1.0, src=0x0801, dst=0xFFFF, origin="+1", text="pos")
    on = imc.TextMessage(timestamp=6.5, src=OWN, dst=OWN, origin="+44", text="gsm true")
    run = sent(stranger, *ask, on, seconds=20.0)
    assert [number for number, _ in texts(run)] == ["+44"]
    assert run.task.active


def test_reports_are_sent_one_for_each_recipient():
    gsm = imc.ReportControl.CommInterface.GSM
    request = imc.ReportControl(timestamp=5.0, src=CCU, dst=OWN, op=4, comm_interface=gsm, sys_dst="default")
    acoustic = request.replace(comm_interface=1, sys_dst="+9")
    others = [request.replace(sys_dst=f"+{k}") for k in range(40)]
    run = sent(*medium(WATER), request, request, acoustic, *others, seconds=55.0)
    numbers = [number for number, _ in texts(run)]
    assert numbers == [NUMBER, *(f"+{k}" for k in range(15))]
    assert {(m.op, m.dst) for m in run.of(imc.ReportControl) if m.src == OWN} == {(5, CCU)}


def test_a_report_under_water_waits_and_is_confirmed_when_it_is_sent():
    gsm = imc.ReportControl.CommInterface.GSM
    request = imc.ReportControl(timestamp=5.0, src=CCU, dst=OWN, op=4, comm_interface=gsm, sys_dst="+9")
    run = sent(*medium(UNDER), request, imc.VehicleMedium(timestamp=30.0, medium=WATER), seconds=40.0)
    (report,) = [m for m in run.of(imc.Sms) if m.contents.startswith("(R)")]
    (done,) = [m for m in run.of(imc.ReportControl) if m.src == OWN]
    assert 30.0 <= report.timestamp - run.vehicle.start_time < 32.0
    assert done.timestamp == report.timestamp
    lost = sent(*medium(WATER), request.replace(sys_dst="default"), number="", seconds=20.0)
    assert not [m for m in lost.of(imc.ReportControl) if m.src == OWN], "nothing was sent"


def test_what_is_no_number_is_unknown_and_costs_no_message():
    bad = [imc.FuelLevel(timestamp=1.0, value=math.nan, confidence=math.inf), EXECUTING.replace(plan_progress=math.nan)]
    run = sent(*medium(WATER), *bad, *abort(5.0), seconds=20.0)
    assert [text.split(" / ", 2)[2] for _, text in texts(run)] == ["f:-1 v:-1 c:-1 / s: ? / p:-1"]


@pytest.mark.parametrize(("interface", "sms", "iridium"), [("GSM", 1, 0), ("Iridium", 0, 1), ("Both", 1, 1)])
def test_the_modem_can_be_chosen(interface, sms, iridium):
    run = sent(*medium(WATER), transmission_interface=interface)
    assert (len(run.of(imc.Sms)), len(run.of(imc.IridiumMsgTx))) == (sms, iridium)


def test_without_a_number_it_says_so_and_sends_nothing():
    run = sent(*medium(WATER), number="")
    assert not texts(run)
    assert run.task.entity.description == "no SMS Recipient Number is set"
    assert any(text.startswith("no telephone number for (T)") for text in run.log)
