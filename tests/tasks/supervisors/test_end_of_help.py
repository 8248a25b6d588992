"""The end of the help by which `Failsafe` brings up an AUV."""

import pytest

import imc
from runtime import State
from runtime.fault_injection import Crash, Injection
from tests.tasks.supervisors.guarded import ON, Loops, guarded


@pytest.mark.parametrize("end", ["crash", "no thrust", "the process ends"])
def test_the_motor_stops_with_the_help_however_that_ends(end):
    off = imc.ControlLoops(timestamp=1.0, enable=0, mask=Loops.PATH, scope_ref=5)
    depths = [imc.Depth(timestamp=0.1 * k, value=3.0 if k < 300 else max(0.0, 12.0 - 0.03 * k)) for k in range(600)]
    again = ON.replace(timestamp=45.0, scope_ref=6)
    options = {"servos": [0, 1, 2, 3], "ascent_thrust": 0.6, "required_messages": [], "seconds": 60.0}
    feed = [ON, off, *depths, again]
    if end == "crash":
        options |= {"keep_going": True, "faults": [Injection(Crash(), start=30.05)]}
    elif end == "no thrust":
        value = imc.EntityParameter(name="Ascent Thrust", value="0")
        feed.append(imc.SetEntityParameters(timestamp=30.05, name="Failsafe", params=(value,)))
    else:
        options["seconds"] = 30.05
    run = guarded(*feed, **options)
    begin = run.vehicle.start_time
    thrusts = [(m.timestamp - begin, m.value) for m in run.of(imc.SetThrusterActuation)]
    fins = [(m.timestamp - begin, m.value) for m in run.of(imc.SetServoPosition)]
    assert any(value for _, value in thrusts)
    assert 30.0 <= thrusts[-1][0] < 30.6, "no command during the next plan"
    assert thrusts[-1][1] == 0.0
    assert [value for _, value in fins[-4:]] == [0.0] * 4
    if end != "the process ends":
        assert run.task.entity.state is State.NORMAL
