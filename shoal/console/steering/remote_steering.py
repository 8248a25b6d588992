"""Steering of a vehicle by hand from the page: positions of a stick become RemoteActions."""

import asyncio
import math
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Self

import imc
from autonomy.control import format_remote_actions
from autonomy.plans import sequential_plan
from imc.tuple_list import parse_tuple_list
from shoal.console.vehicle_orders import start
from shoal.console.vehicle_view import RUNNING, word
from shoal.network import AsyncRemoteVehicle
from support.number_parsing import finite_number

PLAN = "console-steer"
"""Name of the plan in which the page steers."""
AXES = frozenset(("Heading", "Thrust", "Pitch"))  # of a vehicle that does not report its own
QUERY_PERIOD = 1.0  # s between two questions, whose answers show the delay
MOST_DELAY = 1.5  # s from a question to its answer
LONGEST_SILENCE = 3.0  # s without an answer
QUESTIONS = 200  # numbers of questions, as entities of this console
REPEATS, REPEAT = 4, 0.5  # times, s: TeleoperationDone, which may be lost


class SteeringError(Exception):
    """Steering that cannot continue; the text is for the operator."""


@dataclass(frozen=True)
class StickPosition:
    """Shares of full deflection, -1 to 1: ahead, to starboard in turn, up, and sideways to starboard."""

    ahead: float = 0.0
    turn: float = 0.0
    up: float = 0.0
    side: float = 0.0

    @classmethod
    def parse(cls, words: Mapping[str, object]) -> Self:
        """Make it from numbers of the page; what is no number is neutral."""
        return cls(*(_share(words.get(name)) for name in ("ahead", "turn", "up", "side")))

    def remote_actions(self, offer: Collection[str]) -> str:
        """The text of RemoteActions, with those axes that the vehicle offers.

        One with Roll is a multirotor: Pitch and Roll are its speed ahead and to starboard, Thrust its climb.
        """
        if "Roll" in offer:
            shares = {"Heading": self.turn, "Thrust": self.up, "Pitch": -self.ahead, "Roll": self.side}
        else:
            shares = {"Heading": self.turn, "Thrust": self.ahead, "Pitch": self.up}
        return format_remote_actions({name: share for name, share in shares.items() if name in offer})


NEUTRAL = StickPosition()


class RemoteSteering:
    """Steers one vehicle, which executes the plan `console-steer` meanwhile.

    The vehicle is asked once a second for its axes: answers that come late, or not, end the steering, since commands
    would come late, too.
    """

    def __init__(self, vehicle: AsyncRemoteVehicle) -> None:
        self._vehicle = vehicle
        self._network, self._system = vehicle.network, vehicle.system
        self._listener = self._network.listen(self._system, (imc.RemoteActionsRequest, imc.PlanControlState))
        self._asked: dict[int, float] = {}
        self._question = 0
        self._answered = -math.inf
        self.offer: frozenset[str] = AXES

    async def begin(self) -> str:
        """Start the plan; returns the vehicle's answer. Raises OrderError, NetworkError."""
        teleoperation = imc.Teleoperation(custom=f"src={self._network.console.id}")
        answer = await start(self._vehicle, sequential_plan(PLAN, {"steer": teleoperation}))
        self._listener.take_all()  # of the time before
        self._answered = time.monotonic()
        return answer

    def send(self, stick: StickPosition) -> None:
        """Steer now."""
        self._network.send(self._system, imc.RemoteActions(actions=stick.remote_actions(self.offer)))

    def check(self) -> None:
        """Ask the vehicle, and read its answers. Raises SteeringError if it does not obey this page any more."""
        now = time.monotonic()
        for _, message in self._listener.take_all():
            if isinstance(message, imc.RemoteActionsRequest):
                self._take_offer(message, now)
            elif isinstance(message, imc.PlanControlState) and message.src == self._system.id:
                self._check_plan(message)
        if not self._system.is_there:
            raise SteeringError("the vehicle is lost")
        if now - self._answered > LONGEST_SILENCE:
            raise SteeringError(f"the vehicle has not answered for {LONGEST_SILENCE:g} s")
        if now - self._asked.get(self._question, -math.inf) >= QUERY_PERIOD:
            self._question = self._question % QUESTIONS + 1
            self._asked[self._question] = now
            query = imc.RemoteActionsRequest(op=imc.RemoteActionsRequest.Op.QUERY)
            self._network.send(self._system, query, self._question)

    async def end(self) -> None:
        """Let go of the vehicle: neutral at once, then the end of the maneuver, also if the task is cancelled."""
        try:
            for _ in range(REPEATS):
                state = self._system.latest_message(imc.PlanControlState)
                if state is not None and not _steers(state):
                    return
                self.send(NEUTRAL)
                self._network.send(self._system, imc.TeleoperationDone())
                await asyncio.sleep(REPEAT)
        finally:
            self._network.close_listener(self._listener)

    def _take_offer(self, request: imc.RemoteActionsRequest, now: float) -> None:
        if request.src != self._system.id or request.op != imc.RemoteActionsRequest.Op.REPORT:
            return
        offer = frozenset(name for name, kind in parse_tuple_list(request.actions).items() if kind == "Axis")
        if offer:  # a supervisor answers, too, of its switches
            self.offer = offer
        asked = self._asked.pop(request.dst_ent, None)
        if asked is None:
            return
        if now - asked > MOST_DELAY:
            raise SteeringError(f"the vehicle answers {now - asked:.1f} s late")
        self._answered = max(self._answered, now)

    def _check_plan(self, state: imc.PlanControlState) -> None:
        if _steers(state):
            return
        mode = self._system.latest_message(imc.VehicleState)
        text = "mode unknown" if mode is None else f"mode {word(imc.VehicleState.OpMode, mode.op_mode)}"
        if state.state in RUNNING:
            text = f"it executes {state.plan_id}"
        raise SteeringError(f"the vehicle is not steered any more: {text}")


def _steers(state: imc.PlanControlState) -> bool:
    return state.plan_id == PLAN and state.state in RUNNING


def _share(value: object) -> float:
    return max(-1.0, min(1.0, finite_number(value) or 0.0))
