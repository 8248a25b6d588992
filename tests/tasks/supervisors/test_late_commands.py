"""Commands of the own plan engine that come after an Abort and were sent before it."""

import pytest
from flying import BROADCAST, CCU, OWN

import imc
from runtime import Task, consume, param
from runtime.testing import simulate
from tasks.supervisors.vehicle import Vehicle

Command = imc.VehicleCommand.Command
CALM = [imc.EntityMonitoringState(timestamp=float(second), mcount=1, mnames="Daemon") for second in range(10)]


class Engine(Task):
    """Publishes, after an Abort, a command that was sent some time before it."""

    command: int = param(0, "", "What it commands.")
    before: float = param(0.0, "s", "How long before the Abort it was sent; after it if negative.")

    @consume(others=True)
    def give_command(self, _: imc.Abort) -> None:
        self.after(max(0.0, -self.before), self.publish_command, self.now - self.before)

    def publish_command(self, time: float) -> None:
        command = imc.VehicleCommand(timestamp=time, command=self.command, maneuver=imc.Goto(), dst=OWN)
        self.publish(command, keep_time=True)


@pytest.mark.parametrize("command", [Command.EXEC_MANEUVER, Command.START_CALIBRATION])
@pytest.mark.parametrize(("before", "begins"), [(0.01, False), (-1.0, True)])
def test_what_was_commanded_before_an_abort_does_not_begin(command, before, begins):
    tasks = [(Vehicle, {}), (Engine, {"command": command.value, "before": before})]
    run = simulate(tasks, feed=[*CALM, imc.Abort(timestamp=4.5, src=CCU, dst=BROADCAST)], seconds=6.0)
    assert (run.of(imc.VehicleCommand)[-1].type == imc.VehicleCommand.Type.SUCCESS) is begins
    assert (run.of(imc.Goto) != []) is begins
