"""Decides what an autopilot is told: its mode, whether it is armed, where it goes."""

import math
from collections.abc import Callable, Sequence
from enum import Enum, auto

from mavlink import Fields
from tasks.control.autopilot.kinds import Body
from tasks.control.autopilot.leg import Leg, Whereabouts
from tasks.control.autopilot.memory import Memory
from tasks.control.autopilot.orders import ACCEPTED, in_words
from tasks.control.autopilot.targets import Order, command, one_command, speed_order, target

SET_MODE, ARM, TAKEOFF, MISSION_START = 176, 400, 22, 300  # MAV_CMD
CUSTOM_MODE = 1
RETRY, TRIES = 1.5, 3  # s
ALOFT = 1.0  # m above home; higher, it is in the air
WINGS_ALOFT = 15.0  # m; higher, a plane has taken off
TARGET = "SET_POSITION_TARGET_GLOBAL_INT"
IN_AIR = 2  # MAV_LANDED_STATE
LATE = 3.0  # s in which an autopilot tells again how far it has come with its mission
WARM_UP = 1.0  # s of setpoints before PX4 is asked to follow them

Give = Callable[[str, Fields, Callable[[int], object]], object]


class Errand(Enum):
    """What the pilot has to do; ENDS is what follows an Abort, or a long time without a maneuver."""

    NONE = auto()
    HOLD = auto()
    ENDS = auto()
    GO = auto()
    TAKE_OFF = auto()
    LAND = auto()


LED = (Errand.GO, Errand.TAKE_OFF, Errand.LAND)


class Pilot:
    """Leads an autopilot step by step: mode, arming, speed and target, each confirmed before the next.

    What the autopilot says counts: a command is done when HEARTBEAT shows it. A mode that changes after it was reached
    is the will of a person or a failsafe, and is not fought.

    give: sends a command, and calls with its result. send: sends a message. say: tells people. why: what the autopilot
    has said last, or "". memory: the mission that the autopilot keeps.
    """

    def __init__(
        self,
        give: Give,
        send: Callable[[str, Fields], object],
        say: Callable[[str], object],
        why: Callable[[], str],
        memory: Memory,
    ) -> None:
        self._give, self._send, self._say, self._why, self.memory = give, send, say, why, memory
        self.body: Body | None = None
        self.mode, self.armed, self.landed_state = -1, False, 0
        self.at: Whereabouts | None = None
        self.leg: Leg | None = None
        self.error = ""
        self.errand = Errand.NONE
        self.since = -math.inf
        self._ending, self._number = "hold", 0
        self._lost_in: int | None = None
        self._begin(Errand.NONE, -math.inf)

    @property
    def leads(self) -> bool:
        return self.errand in LED

    @property
    def waits(self) -> bool:
        """Whether no progress is expected: the mission is being written, or a plane circles down to its landing."""
        return self.memory.busy or (self.errand is Errand.LAND and self.body is not None and self.body.roams)

    def follow(self, leg: Leg, now: float) -> None:
        """Carry out a leg."""
        self.leg, self.error = leg, ""
        self._begin(Errand.TAKE_OFF if leg.takes_off else Errand.LAND if leg.lands else Errand.GO, now)

    def release(self, now: float) -> None:
        """Hold where it is; unless somebody else has taken over."""
        self.leg, self.error = None, ""
        taken, self._taken = self._taken or self._is_overridden(), False
        if not taken and self.errand is not Errand.ENDS:
            self._begin(Errand.HOLD, now)

    def _is_overridden(self) -> bool:
        """Whether somebody has chosen another mode than that which was reached, and the leg has not noticed yet."""
        body = self.body
        if body is None or not self.leads or self._reached is None:
            return False
        return self.mode not in (self._reached, body.hold, body.land, body.takeoff, body.orbit)

    def end(self, ending: str, now: float) -> None:
        """End in the mode `ending`: hold, return, land or disarm."""
        self.leg, self._ending = None, ending
        self._begin(Errand.ENDS, now)

    def lose(self, now: float) -> None:
        """The autopilot has fallen silent: the leg is over, and it has to hold when it is back."""
        self.leg, self.at = None, None
        if self.errand is not Errand.NONE:
            self._begin(self.errand if self.errand is Errand.ENDS else Errand.HOLD, now)
        self._lost_in, self.mode = self.mode, -1

    def meet(self, mode: int, armed: bool, now: float) -> None:
        """The autopilot is heard, for the first time or again.

        In another mode than before somebody else leads it. One that flies in GUIDED was led by this task before a
        restart.
        """
        before, self._lost_in = self._lost_in, None
        if before is not None and before != mode:
            self._begin(Errand.NONE, now)
        body = self.body
        if before is None and body is not None and armed and mode == body.guided and mode != body.hold:
            self._begin(Errand.HOLD, now)

    def refuse(self, reason: str) -> None:
        """Something cannot be done: the plan must end."""
        self.error, self.leg = reason, None
        self._begin(Errand.NONE, -math.inf)

    def step(self, now: float) -> None:
        """Do what is next."""
        body = self.body
        if body is None or self.mode < 0:
            return
        if body.offboard:
            self._stream(body, now)
        if self._asked or now < self._due:
            return
        if self.errand in (Errand.HOLD, Errand.ENDS):
            self._rest(body, now)
        elif self.leg is not None and self.at is not None:
            self._lead(body, self.leg, self.at, now)

    def _begin(self, errand: Errand, now: float) -> None:
        self.errand, self.since = errand, now
        self._sent = self._sped = self._asked = self._taken = self._had_arms = self._yields = False
        self._reached: int | None = None
        self._streams_since = self._left = math.inf
        self._tries, self._due = 0, -math.inf
        self._asked_for: tuple[float, ...] = ()
        self._number += 1

    def _rest(self, body: Body, now: float) -> None:
        """Reach the mode of an errand without a leg."""
        if not self.armed:
            self._begin(Errand.NONE, now)
            return
        if self.errand is Errand.HOLD:
            wanted = self._hold(body)
        elif self._ending == "disarm" and not body.flies:
            self._arm(now, 0)
            return
        else:
            ways = {"return": body.back, "land": body.land, "disarm": body.land}
            wanted = ways.get(self._ending) or (body.back if self._ending == "land" and body.flies else None)
            wanted = wanted or self._hold(body)
        if self._reached is not None and self.mode != wanted:
            self._say("another mode was chosen: Shoal does not steer now")
            self._begin(Errand.NONE, now)
            return
        self._reach(now, wanted)

    def _hold(self, body: Body) -> int:
        """The mode that holds; another one once it has been refused, as without a position."""
        if self._tries >= TRIES and body.instead is not None and not self._yields:
            self._yields, self._tries = True, 0
        return body.instead if self._yields and body.instead is not None else body.hold

    def _lead(self, body: Body, leg: Leg, at: Whereabouts, now: float) -> None:
        if self.errand is Errand.LAND and not self.armed:
            leg.near = True
        elif leg.item is not None:
            self._remember(body, leg, now)
        elif self.errand is Errand.TAKE_OFF and not self._aloft(body, at):
            self._take_off(body, leg, at, now)
        elif self.errand is Errand.LAND and leg.arrived:
            self._land(body, now)
        elif body.flies and not self.armed:
            self.refuse("on the ground: take off first")
        elif body.offboard and self.mode != body.guided and now - self._streams_since < WARM_UP:
            return
        elif self._reach(now, body.guided, *self._also(body, leg)) and (body.flies or self._arm(now, 1)):
            self._go(body, leg, at, now)

    def _remember(self, body: Body, leg: Leg, now: float) -> None:
        """Let the autopilot carry out the mission in its memory from a leg on; it goes on to the next by itself."""
        memory, starts = self.memory, self.errand is Errand.TAKE_OFF
        if leg.near or memory.busy:
            return
        if not memory.ready:
            self.refuse(memory.error or "another mission was put into the autopilot")
        elif body.flies and not self.armed and not starts:
            self.refuse(f"it was disarmed{self._because()}" if self._had_arms else "on the ground: take off first")
        elif not memory.recall(leg.start, now):
            return
        elif not self.armed and not body.roams:  # ArduPilot's copters are not armed in AUTO
            if self._reach(now, body.mission if body.px4 else body.ready):
                self._arm(now, 1)
        elif self._may_be_over(body, now):
            return
        elif self._reach(now, body.mission) and self._arm(now, 1) and starts and not self._sent:
            self._command(command("the mission", MISSION_START, (0.0, 0.0)))

    def _may_be_over(self, body: Body, now: float) -> bool:
        """Whether it has left the mission at its last item just now: that it has done it may not be told yet, or lost.

        Autopilots hold or return by themselves after a mission.
        """
        left = self._reached == body.mission and self.mode in (body.hold, body.back)
        if not left or self.memory.current < len(self.memory.items) - 1:
            self._left = math.inf
            return False
        self._left = min(self._left, now)
        return now - self._left < LATE

    def _stream(self, body: Body, now: float) -> None:
        """Send setpoints while PX4 is led, or still follows them: it takes an end of the stream for a failure."""
        led = self.leads and self.leg is not None and self.leg.item is None
        if self.at is None or not (led or self.mode == body.guided):
            self._streams_since = math.inf
            return
        self._streams_since = min(self._streams_since, now)
        self._send(TARGET, target(body, self.leg if led else None, self.at))

    def _also(self, body: Body, leg: Leg) -> Sequence[int]:
        """Other modes in which the leg may be: those into which the autopilot goes by itself."""
        after = [body.takeoff] if self.errand is Errand.TAKE_OFF and self._sent else []
        around = [body.orbit] if leg.radius and self._sent else []
        return [mode for mode in (*after, *around) if mode is not None]

    def _aloft(self, body: Body, at: Whereabouts) -> bool:
        """Whether a takeoff needs no command of its own: it is in the air already, and did not take off just now."""
        if not self.armed:
            return False
        if body.roams:
            return at.above_home > WINGS_ALOFT
        return not self._sent and (at.above_home > ALOFT or self.landed_state == IN_AIR)

    def _take_off(self, body: Body, leg: Leg, at: Whereabouts, now: float) -> None:
        if self._sent and not self.armed:
            self.refuse(f"it did not take off{self._because()}")
            return
        if body.roams and not body.px4 and body.takeoff is not None:
            if self._reach(now, body.takeoff):
                self._arm(now, 1)
            return
        also = [mode for mode in (body.takeoff,) if mode is not None] if self._sent else []
        if not self._reach(now, body.ready, *also) or not self._arm(now, 1) or self._sent:
            return
        height = at.amsl - at.above_home + leg.height if body.px4 else leg.height
        place = (math.nan, math.nan, math.nan) if body.px4 else (0.0, 0.0, 0.0)
        self._command(command("a takeoff", TAKEOFF, (0.0, 0.0, 0.0, *place, height)))

    def _land(self, body: Body, now: float) -> None:
        if body.land is None:
            self.refuse(f"a {body.name} cannot land on command")
        else:
            self._reach(now, body.land)

    def _go(self, body: Body, leg: Leg, at: Whereabouts, now: float) -> None:
        if not self._sped and (body.targets or body.roams) and not body.offboard:
            self._sped = True
            self._order(speed_order(body, leg.speed), final=False, aloud=True)
            if not body.targets:
                return
        if body.targets:
            if not body.offboard:
                self._send(TARGET, target(body, leg, at))
        elif not self._sent:
            self._command(one_command(body, leg, at))

    def _reach(self, now: float, wanted: int, *also: int) -> bool:
        """Whether it is in the wanted mode; asks for it, if not."""
        if self.mode == wanted or self.mode in also:
            if self._reached != wanted:
                self._reached, self._tries = wanted, 0
            return True
        if self._reached == wanted and self.leads:
            self.refuse("a pilot or a failsafe has chosen another mode: Shoal does not steer now")
            self._taken = True
            return False
        main, sub = (wanted >> 16 & 0xFF, wanted >> 24) if wanted > 0xFFFF else (wanted, 0)
        self._ask("the mode", SET_MODE, (float(CUSTOM_MODE), float(main), float(sub)), now)
        return False

    def _arm(self, now: float, wanted: int) -> bool:
        """Whether it is armed, or disarmed, as wanted; asks for it, if not."""
        if self.armed == bool(wanted):
            self._had_arms = True
            return True
        if self._had_arms and self.leads:
            self.refuse(f"it was disarmed{self._because()}")
        else:
            self._ask("arming" if wanted else "disarming", ARM, (float(wanted),), now)
        return False

    def _ask(self, what: str, number: int, values: Sequence[float], now: float) -> None:
        """Give a command until HEARTBEAT shows its effect; a leg is given up when that takes too long."""
        if self._asked_for != (number, *values):
            self._asked_for, self._tries = (number, *values), 0
        if self._tries >= TRIES and self.leads:
            self.refuse(f"{what} was accepted, but did not come{self._because()}")
            return
        self._tries += 1
        self._due = now + RETRY
        self._order(command(what, number, values), final=self._tries == TRIES)

    def _command(self, order: Order) -> None:
        """Give a command once; a leg that the autopilot refuses is given up."""
        self._sent = True
        self._order(order, final=True)

    def _order(self, order: Order, *, final: bool, aloud: bool = False) -> None:
        self._asked, number = True, self._number

        def settle(result: int) -> None:
            if number != self._number:  # about an errand that is over
                return
            self._asked = False
            if result == ACCEPTED:
                return
            reason = f"{order.what} was {in_words(result)}{self._because()}"
            if final and self.leads:
                self.refuse(reason)
            elif final or aloud:
                self._say(reason)

        self._give(order.message, order.fields, settle)

    def _because(self) -> str:
        text = self._why()
        return f": {text}" if text else ""
