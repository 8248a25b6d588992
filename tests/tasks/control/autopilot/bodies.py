"""A vehicle of a shipped profile, whose body is a stand-in for an autopilot, on real sockets, in time without waits."""

import os

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from runtime.kernel import SECOND
from shoal.missions import parse_plan, prepare
from tests.outside import ALONE, free_port
from tests.tasks.control.autopilot.stand_in import StandIn
from tests.tasks.control.autopilot.stand_in_hand import handle, parse_options

START = 1_750_000_000 * SECOND
TICK = SECOND // 50
CONSOLE = 0x4000
OPERATOR = imc.PlanControl
SERIAL = "serial"


PATIENT = (
    "Control.Autopilot.MAVLink:Input Timeout=60",
    "Control.Autopilot.MAVLink:Position Timeout=40",
    "Supervisors.Failsafe:Silence Timeout=60",
)


class CommonTime:
    """Time of a vehicle and of the autopilots beside it: as soon as one has nothing to do, the others go on."""

    virtual = False
    speed = 20.0  # not 1: that would be compared with the system's time

    def __init__(self):
        self.time, self.autopilots = START, []

    def read(self):
        return self.time

    def advance(self, target, wait):
        wait(0.0)
        tick = self.time + TICK
        self.time = tick if target is None else max(self.time, min(target, tick))
        for autopilot in self.autopilots:
            autopilot.go_on(self.time)
        return self.time


class Autopilot:
    """A stand-in that runs until it is killed."""

    def __init__(self, options, time):
        self.began, self.runs = time, True
        self.stand_in = StandIn(options, epoch=time / SECOND)

    def go_on(self, time):
        if self.runs:
            self.stand_in.go_on((time - self.began) / SECOND)

    def kill(self):
        self.runs = False
        self.stand_in.wire.close()


class Body:
    """A running vehicle and its autopilot; `said` has all messages by type, `modes` what the autopilot was in."""

    def __init__(
        self,
        profile,
        folder,
        *options,
        kind="copter",
        overrides=PATIENT,
        address="udpin://127.0.0.1:{port}",
    ):
        self.port, self.options, self.kind, self.clock = free_port(), options, kind, CommonTime()
        self.has_failed = False
        self.line, self.diary = (), folder / "diary"
        if address == SERIAL:
            self.line = os.openpty()
            address, options = f"serial://{os.ttyname(self.line[1])}?baud=115200", ("--serial", str(self.line[0]))
        self.said = {}
        address = f"Control.Autopilot.MAVLink:Address={address.format(port=self.port)}"
        patient = "Monitors.Entities:Report Timeout=60"
        never = [setting for setting in ALONE if "MAVLink" not in setting] + ["Transports.MAVLink:Enabled=Never"]
        made = prepare(
            profile,
            ["Hardware"],
            clock=self.clock,
            overrides=[address, patient, *never, *overrides],
            log_root=folder / "log",
            state_folder=folder / "db",
        )
        self.vehicle = made.vehicle
        for kind_of in (imc.EstimatedState, imc.PlanControlState, imc.AutopilotMode, imc.EntityState,
                        imc.LogBookEntry, imc.ArmingState, imc.VehicleState, imc.PathControlState,
                        imc.PlanControl):  # fmt: skip
            self.said[kind_of] = []
            self.vehicle.observe(kind_of, self.said[kind_of].append)
        self.vehicle.start()
        self.autopilot = self.stand_in("--diary", str(self.diary), *options, kind=self.kind)

    def stand_in(self, *options, kind="copter"):
        started = Autopilot(parse_options([str(self.port), "--kind", kind, *options]), self.clock.time)
        self.clock.autopilots.append(started)
        return started

    def tell(self, words, autopilot=None):
        for line in words.splitlines():
            handle((autopilot or self.autopilot).stand_in, line)

    def publish(self, message, source=(CONSOLE, 0xFF)):
        packet = imc.encode_with_header(message, self.vehicle.kernel.now_ns / 1e9, *source, self.vehicle.system,
                               UNKNOWN_ENTITY)  # fmt: skip
        self.vehicle.kernel.post(self.vehicle.bus.deliver_and_send, imc.decode(packet), packet, None)

    def last(self, kind):
        return self.said[kind][-1] if self.said[kind] else None

    def state(self, label):
        entity = self.vehicle.entities.find(label)
        return f"{entity.state.name}: {entity.description}"

    def texts(self):
        return [entry.text for entry in self.said[imc.LogBookEntry]]

    @property
    def modes(self):
        return [mode.mode for mode in self.said[imc.AutopilotMode]]

    @property
    def armed(self):
        return self.last(imc.ArmingState).state == imc.ArmingState.State.ARMED

    def wait(self, condition, patience=240.0):
        """Let time pass until a condition holds, at most so long (s); returns what made it true."""
        end = self.clock.time + round(patience * SECOND)
        while not (found := condition()):
            assert self.clock.time < end, f"waited {patience} s; {self.texts()[-8:], self.modes}"
            if self.has_failed:
                self.clock.advance(None, lambda _: None)
            else:
                self.vehicle.run(0.1)
        return found

    def ready(self):
        self.wait(lambda: (s := self.last(imc.VehicleState)) and s.op_mode == imc.VehicleState.OpMode.SERVICE)

    def start(self, text):
        self.start_file("plan: test\norigin: 41.185°, -8.7062°\nspeed: 5 m/s\nmaneuvers:\n" + text)

    def start_file(self, text):
        plan = parse_plan(text)
        self.publish(OPERATOR(op=OPERATOR.Op.START, plan_id=plan.plan_id, arg=plan, request_id=1))

    def outcome(self):
        """How the plan ended, once it has begun."""
        states = self.said[imc.PlanControlState]
        began = next((i for i, s in enumerate(states) if s.state == imc.PlanControlState.State.EXECUTING), None)
        if began is None or states[-1].state == imc.PlanControlState.State.EXECUTING:
            return None
        return imc.PlanControlState.LastOutcome(states[-1].last_outcome).name

    def seen(self):
        """What the stand-in has written of itself: mode, arming, north, east and up (m), second by second."""
        lines = self.diary.read_text().splitlines() if self.diary.exists() else []
        return [(int(mode), armed == "1", *map(float, at)) for mode, armed, *at in map(str.split, lines)]

    def die(self):
        """This computer fails; the autopilot does not."""
        self.has_failed = True

    def close(self):
        for autopilot in self.clock.autopilots:
            autopilot.kill()
        self.vehicle.close()
        for end in self.line:
            os.close(end)
