"""An order whose plan is over at once has been carried out; one that is accepted and not begun has not."""

import asyncio

import pytest

import imc
from shoal.console.vehicle_orders import OrderError, start
from shoal.network import AsyncRemoteVehicle, Network
from tests.shoal.console.foxglove.packet_radio import Radio

HEADER = {"src": 0x1A, "src_ent": 7, "timestamp": 1.7e9}
State = imc.PlanControlState.State
ANNOUNCE = imc.Announce(sys_name="lauv-noptilus-1", sys_type=imc.SystemType.UUV, **HEADER)


class ObedientRadio(Radio):
    """Accepts each plan, and reports the states of `follow` for it."""

    follow = ()

    def send(self, system, message, packet):
        if isinstance(message, imc.PlanControl):
            reply = {"op": message.op, "request_id": message.request_id, "dst": imc.decode(packet).src}
            self.bring(imc.PlanControl(type=imc.PlanControl.Type.SUCCESS, **reply, **HEADER))
            self.bring(*(imc.PlanControlState(state=state, plan_id=message.plan_id, **HEADER) for state in self.follow))


async def start_plan(follow):
    radio = ObedientRadio()
    radio.follow = follow
    async with Network([radio]) as network:
        radio.bring(ANNOUNCE)
        vehicle = AsyncRemoteVehicle(network, network.systems["lauv-noptilus-1"])
        return await start(vehicle, "up")


def test_a_plan_that_is_over_at_once_was_carried_out():
    assert "is carried out" in asyncio.run(start_plan((State.EXECUTING, State.READY)))


def test_a_plan_that_is_accepted_and_not_begun_is_not():
    with pytest.raises(OrderError, match="accepted, but is not carried out"):
        asyncio.run(start_plan((State.READY,)))
