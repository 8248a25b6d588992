"""A vehicle of a shipped profile, whose body is a stand-in for an autopilot in another process, on real sockets."""

import contextlib
import os
import subprocess
import sys
import threading
from pathlib import Path

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from shoal.missions import parse_plan, prepare
from tests.outside import ALONE, PATIENCE, free_port, until

SPEED = 12.0
ROOT = Path(__file__).parents[4]
CONSOLE = 0x4000
OPERATOR = imc.PlanControl
SERIAL = "serial"


PATIENT = (
    "Control.Autopilot.MAVLink:Input Timeout=60",
    "Control.Autopilot.MAVLink:Position Timeout=40",
    "Supervisors.Failsafe:Silence Timeout=60",
)


class Body:
    """A running vehicle and its autopilot; `said` has all messages by type, `modes` what the autopilot was in."""

    def __init__(
        self,
        profile,
        folder,
        *options,
        kind="copter",
        speed=SPEED,
        overrides=PATIENT,
        address="udpin://127.0.0.1:{port}",
    ):
        self.speed = speed
        self.port, self.options, self.kind, self.others = free_port(), options, kind, []
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
            clock=f"{speed:g}x",
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
        self.thread = threading.Thread(target=self.vehicle.run, daemon=True)
        self.thread.start()
        self.autopilot = self.stand_in("--diary", str(self.diary), *options, kind=self.kind)

    def stand_in(self, *options, kind="copter"):
        program = ["-m", "tests.tasks.control.autopilot.stand_in", str(self.port)]
        command = [sys.executable, *program, "--kind", kind, "--speed", f"{self.speed:g}", *options]
        more = {"pass_fds": [self.line[0]]} if self.line else {}
        started = subprocess.Popen(command, stdin=subprocess.PIPE, text=True, cwd=ROOT, **more)
        self.others.append(started)
        return started

    def tell(self, words, autopilot=None):
        pipe = (autopilot or self.autopilot).stdin
        pipe.write(words + "\n")
        pipe.flush()

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

    def wait(self, condition, patience=PATIENCE):
        return until(condition, patience, told=lambda: (self.texts()[-8:], self.modes))

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
        self.vehicle.kernel.post(self.vehicle.stop)
        self.thread.join(20.0)

    def close(self):
        for started in self.others:
            with contextlib.suppress(OSError):
                started.stdin.close()
            started.kill()
            started.wait()
        self.vehicle.kernel.post(self.vehicle.stop)
        self.thread.join(20.0)
        self.vehicle.close()
        for end in self.line:
            os.close(end)
