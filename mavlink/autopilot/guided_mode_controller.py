"""Commands an autopilot: its mode, whether it is armed, where it goes."""

import math
from collections.abc import Callable, Sequence

from mavlink import Fields
from mavlink.autopilot.command_client import ACCEPTED, WITHDRAWN, result_text
from mavlink.autopilot.guided_goal import LEADING, GuidedGoal
from mavlink.autopilot.leg import Leg, ReportedPosition, is_airborne
from mavlink.autopilot.leg_speed import LegSpeed
from mavlink.autopilot.mission_client import MissionClient
from mavlink.autopilot.position_targets import PositionTargets
from mavlink.autopilot.setpoints import (
    CommandMessage,
    command_message,
    leg_command,
    offboard_setpoint,
    takeoff_command,
)
from mavlink.autopilot.takeoff_order import TakeoffOrder
from mavlink.autopilot.vehicle_modes import SteeredVehicle

SET_MODE, ARM, MISSION_START = 176, 400, 300  # MAV_CMD
CUSTOM_MODE = 1
RETRY, TRIES = 1.5, 3  # s
POSITION_TARGET = "SET_POSITION_TARGET_GLOBAL_INT"
WARM_UP = 1.0  # s of setpoints before PX4 is asked to follow them

SendCommand = Callable[[str, Fields, Callable[[int], object]], object]


class ModeController:
    """Leads an autopilot step by step: mode, arming, speed and target, each confirmed before the next.

    Reports of the autopilot count: a command is done when HEARTBEAT shows it. A mode that changes after it was reached
    is the will of a person or a failsafe, and is not fought.

    send_command: sends a command, and calls with its result. send: sends a message. warn: reports to people. reason:
    the last words of the autopilot, or "". missions: the mission that the autopilot keeps.
    """

    def __init__(
        self,
        send_command: SendCommand,
        send: Callable[[str, Fields], object],
        warn: Callable[[str], object],
        reason: Callable[[], str],
        missions: MissionClient,
    ) -> None:
        self._send_command, self._send_message = send_command, send
        self._warn = warn
        self._reason = reason
        self.missions: MissionClient = missions
        self.targets: PositionTargets = PositionTargets()
        self._speed = LegSpeed()
        self._takeoff = TakeoffOrder(warn)
        self.vehicle: SteeredVehicle | None = None
        self.mode: int = -1
        self.armed: bool = False
        self.landed_state: int = 0
        self.position: ReportedPosition | None = None
        self.leg: Leg | None = None
        self.error: str = ""
        self.goal: GuidedGoal = GuidedGoal.NONE
        self.since: float = -math.inf
        self._ending, self._number = "hold", 0
        self._lost_in: int | None = None
        self._begin(GuidedGoal.NONE, -math.inf)

    @property
    def is_following_leg(self) -> bool:
        return self.goal in LEADING

    @property
    def is_progress_paused(self) -> bool:
        """Whether no progress is expected: the mission is being written, or a plane circles down to its landing."""
        return self.missions.busy or (self.goal is GuidedGoal.LAND and self.vehicle is not None and self.vehicle.roams)

    def follow(self, leg: Leg, now: float) -> None:
        """Carry out a leg."""
        self.leg, self.error = leg, ""
        self.targets.restart()
        self._speed.restart(leg.speed)
        self._begin(GuidedGoal.TAKE_OFF if leg.takes_off else GuidedGoal.LAND if leg.lands else GuidedGoal.GO, now)

    def hold_position(self, now: float) -> None:
        """Hold where it is; unless somebody else has taken over."""
        self.leg, self.error = None, ""
        taken, self._is_taken_over = self._is_taken_over or self._is_overridden(), False
        if not taken and self.goal is not GuidedGoal.ENDS:
            self._begin(GuidedGoal.HOLD, now)

    def _is_overridden(self) -> bool:
        """Whether somebody has chosen another mode than that which was reached, and the leg has not noticed yet."""
        vehicle = self.vehicle
        if vehicle is None or not self.is_following_leg or self._reached is None:
            return False
        return self.mode not in (self._reached, vehicle.hold, vehicle.land, vehicle.takeoff, vehicle.orbit)

    def end_flight(self, ending: str, now: float) -> None:
        """End in the mode `ending`: hold, return, land or disarm."""
        self.leg, self._ending = None, ending
        self._begin(GuidedGoal.ENDS, now)

    def drop_leg_on_silence(self, now: float) -> None:
        """The autopilot has fallen silent: the leg is over, and it has to hold when it is back."""
        self.leg, self.position = None, None
        if self.goal is not GuidedGoal.NONE:
            self._begin(self.goal if self.goal is GuidedGoal.ENDS else GuidedGoal.HOLD, now)
        self._lost_in, self.mode = self.mode, -1

    def restore_goal_on_connection(self, mode: int, armed: bool, now: float) -> None:
        """Messages of the autopilot arrive, for the first time or again.

        In another mode than before somebody else leads it. One that flies in GUIDED was led by this task before a
        restart.
        """
        before, self._lost_in = self._lost_in, None
        if before is not None and before != mode:
            self._begin(GuidedGoal.NONE, now)
        vehicle = self.vehicle
        if before is None and vehicle is not None and armed and mode == vehicle.guided and mode != vehicle.hold:
            self._begin(GuidedGoal.HOLD, now)

    def fail(self, reason: str) -> None:
        """End the plan: an order cannot be carried out."""
        self.error, self.leg = reason, None
        self._begin(GuidedGoal.NONE, -math.inf)

    def tick(self, now: float) -> None:
        """Do what is next."""
        vehicle = self.vehicle
        if vehicle is None or self.mode < 0:
            return
        if vehicle.offboard:
            self._stream(vehicle, now)
        if self._asked or now < self._due:
            return
        if self.goal in (GuidedGoal.HOLD, GuidedGoal.ENDS):
            self._hold_or_end(vehicle, now)
        elif self.leg is not None and self.position is not None:
            self._follow_leg(vehicle, self.leg, self.position, now)

    def _begin(self, goal: GuidedGoal, now: float) -> None:
        self.goal, self.since = goal, now
        self._sent = self._asked = self._is_taken_over = self._had_arms = self._yields = False
        self._reached: int | None = None
        self._streams_since = math.inf
        self._tries, self._due = 0, -math.inf
        self._asked_for: tuple[float, ...] = ()
        self._number += 1

    def _hold_or_end(self, vehicle: SteeredVehicle, now: float) -> None:
        """Reach the mode of a goal without a leg."""
        if not self.armed:
            self._begin(GuidedGoal.NONE, now)
            return
        ending = "hold" if self.goal is GuidedGoal.HOLD else self._ending
        if ending == "disarm" and not vehicle.flies:
            self._arm(now, 0)
            return
        wanted = self._unless_refused(*vehicle.ending_modes(ending))
        if self._reached is not None and self.mode != wanted:
            self._warn("another mode was chosen: Shoal does not steer now")
            self._begin(GuidedGoal.NONE, now)
            return
        self._enter_mode(now, wanted)

    def _unless_refused(self, wanted: int, instead: int | None) -> int:
        """A mode; another one once it has been rejected, as without a position."""
        if self._tries >= TRIES and instead is not None and not self._yields:
            self._yields, self._tries = True, 0
        return instead if self._yields and instead is not None else wanted

    def _follow_leg(self, vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition, now: float) -> None:
        if self.goal is GuidedGoal.LAND and not self.armed:
            leg.near = True
        elif leg.item is not None:
            self._fly_mission(vehicle, leg, now)
        elif self.goal is GuidedGoal.TAKE_OFF and not (
            self.armed and is_airborne(vehicle, at, sent=self._sent, landed_state=self.landed_state)
        ):
            self._take_off(vehicle, leg, at, now)
        elif self.goal is GuidedGoal.LAND and leg.arrived:
            self._land(vehicle, now)
        elif vehicle.flies and not self.armed:
            self.fail("on the ground: take off first")
        elif vehicle.offboard and self.mode != vehicle.guided and now - self._streams_since < WARM_UP:
            return
        elif self._enter_mode(now, vehicle.guided, *self._other_modes(vehicle, leg)) and (
            vehicle.flies or self._arm(now, 1)
        ):
            self._go_to(vehicle, leg, at, now)

    def _fly_mission(self, vehicle: SteeredVehicle, leg: Leg, now: float) -> None:
        """Let the autopilot carry out the mission in its memory from a leg on; it advances to the next by itself."""
        missions, starts = self.missions, self.goal is GuidedGoal.TAKE_OFF
        left = self._reached == vehicle.mission and self.mode in (vehicle.hold, vehicle.back)
        if leg.near or missions.busy:
            return
        if not missions.ready:
            self.fail(missions.error or "another mission was put into the autopilot")
        elif vehicle.flies and not self.armed and not starts:
            self.fail(f"it was disarmed{self._with_reason()}" if self._had_arms else "on the ground: take off first")
        elif not missions.head_for(leg.start, now):
            return
        elif not self.armed and not vehicle.roams:  # ArduPilot's copters are not armed in AUTO
            if self._enter_mode(now, vehicle.mission if vehicle.px4 else vehicle.arming_mode):
                self._arm(now, 1)
        elif missions.may_be_over(now, left=left):
            return
        elif self._enter_mode(now, vehicle.mission) and self._arm(now, 1) and starts and not self._sent:
            self._command(command_message("the mission", MISSION_START, (0.0, 0.0)))

    def _stream(self, vehicle: SteeredVehicle, now: float) -> None:
        """Send setpoints while PX4 is led, or still follows them: it takes an end of the stream for a failure."""
        led = self.is_following_leg and self.leg is not None and self.leg.item is None
        if self.position is None or not (led or self.mode == vehicle.guided):
            self._streams_since = math.inf
            return
        self._streams_since = min(self._streams_since, now)
        self._send_message(POSITION_TARGET, offboard_setpoint(self.leg if led else None, self.position))

    def _other_modes(self, vehicle: SteeredVehicle, leg: Leg) -> Sequence[int]:
        """Other modes in which the leg may be: those that the autopilot enters by itself."""
        after = [vehicle.takeoff] if self.goal is GuidedGoal.TAKE_OFF and self._sent else []
        around = [vehicle.orbit] if leg.radius and self._sent else []
        return [mode for mode in (*after, *around) if mode is not None]

    def _take_off(self, vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition, now: float) -> None:
        flies = is_airborne(vehicle, at, sent=False, landed_state=self.landed_state)
        refused = self._takeoff.error(now, flies=flies) if self._sent else ""
        if refused or (self._sent and not self.armed):
            self.fail(refused or f"it did not take off{self._with_reason()}")
            return
        if flies and (command := self._takeoff.climb.correction(vehicle, leg.speed, -at.vz, now)):
            self._send(command, lambda reason: self._warn(reason) if reason else None)
        if vehicle.roams and not vehicle.px4 and vehicle.takeoff is not None:
            if self._enter_mode(now, vehicle.takeoff):
                self._arm(now, 1)
            return
        also = [mode for mode in (vehicle.takeoff,) if mode is not None] if self._sent else []
        if not self._enter_mode(now, vehicle.arming_mode, *also) or not self._arm(now, 1) or self._sent:
            return
        self._takeoff.give(now)
        self._command(takeoff_command(vehicle, leg, at), self._takeoff.refuse)

    def _land(self, vehicle: SteeredVehicle, now: float) -> None:
        if vehicle.land is None:
            self.fail(f"a {vehicle.name} cannot land on command")
        else:
            self._enter_mode(now, vehicle.land)

    def _go_to(self, vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition, now: float) -> None:
        """Send the target, then its speed: some autopilots lose, or reject, a speed that comes first."""
        if vehicle.offboard:
            return
        if vehicle.targets:
            target = self.targets.due(vehicle, leg, at, now)
            if target is not None:
                self._send_message(POSITION_TARGET, target)
        elif not self._sent:
            self._command(leg_command(vehicle, leg, at))
            if vehicle.px4:
                self._speed.settle("", now)  # the command has it
            return
        command = self._speed.command(vehicle, leg, at, now)
        if command is not None:
            self._send(command, lambda reason: self._on_speed(reason, now))
        if self._speed.warning:
            self._warn(self._speed.warning)
            self._speed.warning = ""
        if self._speed.error:
            self.fail(self._speed.error)

    def _on_speed(self, reason: str, now: float) -> None:
        self._speed.settle(reason, now)
        if reason:
            self.targets.repeat()  # Rover takes a speed only with a target

    def _enter_mode(self, now: float, wanted: int, *also: int) -> bool:
        """Whether the autopilot is in the desired mode; asks for it, if not."""
        if self.mode == wanted or self.mode in also:
            if self._reached != wanted:
                self._reached, self._tries = wanted, 0
            return True
        if self._reached == wanted and self.is_following_leg:
            self.fail("a pilot or a failsafe has chosen another mode: Shoal does not steer now")
            self._is_taken_over = True
            return False
        main, sub = (wanted >> 16 & 0xFF, wanted >> 24) if wanted > 0xFFFF else (wanted, 0)
        self._request("the mode", SET_MODE, (float(CUSTOM_MODE), float(main), float(sub)), now)
        return False

    def _arm(self, now: float, wanted: int) -> bool:
        """Whether the autopilot is armed, or disarmed, as desired; asks for it, if not."""
        if self.armed == bool(wanted):
            self._had_arms = True
            return True
        if self._had_arms and self.is_following_leg:
            self.fail(f"it was disarmed{self._with_reason()}")
        else:
            self._request("arming" if wanted else "disarming", ARM, (float(wanted),), now)
        return False

    def _request(self, what: str, number: int, values: Sequence[float], now: float) -> None:
        """Give a command until HEARTBEAT shows its effect; a leg is given up when that takes too long."""
        if self._asked_for != (number, *values):
            self._asked_for, self._tries = (number, *values), 0
        if self._tries >= TRIES and self.is_following_leg:
            self.fail(f"{what} was accepted, but did not come{self._with_reason()}")
            return
        self._tries += 1
        self._due = now + RETRY
        final = self._tries == TRIES
        self._send(command_message(what, number, values), lambda reason: self._on_refusal(reason) if final else None)

    def _command(self, command: CommandMessage, then: Callable[[str], object] | None = None) -> None:
        """Give a command once; a leg that the autopilot rejects is given up, unless `then` takes the refusal."""
        self._sent = True
        self._send(command, then or self._on_refusal)

    def _on_refusal(self, reason: str) -> None:
        if reason and self.is_following_leg:
            self.fail(reason)
        elif reason:
            self._warn(reason)

    def _send(self, command: CommandMessage, then: Callable[[str], object]) -> None:
        """Send a command, and call with "" or the reason for which it was rejected, unless its goal is over by then."""
        self._asked, number = True, self._number

        def settle(result: int) -> None:
            if number != self._number:
                return
            self._asked = False
            if result == WITHDRAWN:  # the autopilot is silent; what still counts afterward is sent again
                self._sent = False
                return
            then("" if result == ACCEPTED else f"{command.what} was {result_text(result)}{self._with_reason()}")

        self._send_command(command.message, command.fields, settle)

    def _with_reason(self) -> str:
        text = self._reason()
        return f": {text}" if text else ""
