"""What is answered for equipment that nobody has."""

import imc
from runtime import Task, consume
from runtime.testing import simulate
from tasks.supervisors.equipment import Equipment

CONSOLE, VEHICLE = 0x4000, 0x001A


class Switch(Task):
    """Controls the power."""

    @consume(others=True)
    def switch(self, request: imc.PowerOperation) -> None:
        self.reply(request, imc.PowerOperation(op=imc.PowerOperation.Op.PWR_DOWN_IP))


def ask(request, tasks=Equipment, **header):
    return simulate(tasks, [request.replace(**{"src": CONSOLE, "dst": VEHICLE, "timestamp": 0.5} | header)])


def test_another_task_that_controls_the_power_answers_instead():
    run = ask(imc.PowerOperation(op=imc.PowerOperation.Op.PWR_DOWN), [Equipment, Switch])
    assert [m.op for m in run.of(imc.PowerOperation)] == [imc.PowerOperation.Op.PWR_DOWN_IP]


def test_states_that_others_report_are_no_requests():
    for message in (imc.PowerOperation(op=imc.PowerOperation.Op.PWR_UP_IP), imc.LblConfig(op=imc.LblConfig.Op.CUR_CFG)):
        assert not ask(message).messages


def test_a_restart_of_an_unknown_kind_or_entity_is_refused_by_name():
    assert "no restart of entity 77 by message" in ask(imc.RestartSystem(type=99, dst_ent=77)).log[-1]
    assert "no restart of Daemon by message" in ask(imc.RestartSystem(type=3, dst_ent=0)).log[-1]


def test_what_is_for_others_and_what_a_vehicle_tells_everybody_is_left_alone():
    request = imc.PowerOperation(op=imc.PowerOperation.Op.PWR_DOWN)
    assert not ask(request, dst=0x0801).messages
    assert not ask(request, src=0x0801, dst=0xFFFF).messages


def test_a_flood_of_requests_does_not_fill_the_log_book():
    request = imc.PowerChannelControl(name="x", src=CONSOLE, dst=VEHICLE)
    run = simulate(Equipment, [request.replace(timestamp=0.0001 * i) for i in range(1, 2000)])
    assert 10 < len(run.log) < 60
