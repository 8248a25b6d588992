"""Commands over a network that loses and repeats packets, and copies of requests."""

import asyncio
import os
from collections.abc import Iterator

import pytest

import imc
from shoal.network import AsyncRemoteVehicle, Network, ZenohLink
from tests.shoal.network.running import Running, running

NAME = "lauv-noptilus-1"
Outcome = imc.PlanControlState.LastOutcome


class Bad(ZenohLink):
    """Loses the first copy of every packet, and sends the second one three times, the last a second later."""

    def __init__(self) -> None:
        super().__init__([os.environ["SHOAL_CONNECT"]])
        self.sent: dict[bytes, int] = {}

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        count = self.sent[packet] = self.sent.get(packet, 0) + 1
        if count == 2:
            for delay in (0.0, 0.05, 1.0):
                asyncio.get_running_loop().call_later(delay, super().send, system, message, packet)


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("vehicle")) as found:
        yield found


def test_a_plan_starts_once_and_ends_once(process: Running) -> None:
    step = imc.PlanManeuver(maneuver_id="wait", data=imc.IdleManeuver(duration=2))
    plan = imc.PlanSpecification(plan_id="once", start_man_id="wait", maneuvers=(step,))

    async def act() -> None:
        async with Network([Bad()]) as network:
            vehicle = AsyncRemoteVehicle(network, await network.find(NAME, 5.0))
            async for _ in vehicle.messages(imc.VehicleState, where="op_mode == SERVICE"):
                break
            commands = network.listen(vehicle.system, (imc.VehicleCommand,))
            outcome = await vehicle.plan.start(plan)
            assert outcome is not None
            assert outcome.completed, outcome.reason
            await asyncio.sleep(1.2)  # the last copy comes after the plan has ended
            assert (await vehicle.plan.status()).state == imc.PlanControlState.State.READY
            await vehicle.plan.delete("once")  # a second deletion would fail
            begun = 0
            try:
                while True:
                    _, command = await commands.next(0.1)
                    assert isinstance(command, imc.VehicleCommand)
                    begun += command.type == imc.VehicleCommand.Type.REQUEST and command.maneuver is not None
            except TimeoutError:
                assert begun == 1

    asyncio.run(act())
