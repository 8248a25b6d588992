"""A console that talks to a vehicle in virtual time."""

import imc
from runtime.kernel import SECOND, VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build

PROFILES = ("lauv-noptilus-1", "otter", "hexa-00")
CONSOLE = 0x4000  # Neptus' default
STEP = 0.05  # s


class Console:
    """A console of a vehicle in virtual time: sends packets to its bus and hears everything."""

    def __init__(self, profile, folder, system=CONSOLE):
        self.state_folder = folder / "db"
        loaded = load_profile(profile, saved=self.state_folder)
        clock = VirtualClock(loaded.start_time_ns)
        made = build(
            loaded,
            loaded.parse_modes("Simulation"),
            clock=clock,
            log_root=folder / "log",
            state_folder=self.state_folder,
        )
        self.vehicle, self.system = made.vehicle, system
        self.heard = []
        self.vehicle.observe(imc.Message, self.heard.append)
        self.vehicle.start()

    @property
    def flies(self):
        return self.vehicle.name == "hexa-00"

    @property
    def now(self):
        return self.vehicle.kernel.now_ns / SECOND

    def send(self, message, dst=None):
        dst = self.vehicle.system if dst is None else dst
        packet = imc.encode_with_header(message, self.now, self.system, 0, dst, message.dst_ent)
        self.vehicle.bus.deliver(self.vehicle.bus.decode(packet), packet)

    def run(self, seconds):
        """What is published in this time."""
        self.heard.clear()
        self.vehicle.run(seconds)
        return [message for message in self.heard if message.src == self.vehicle.system]

    def wait(self, kind, where=lambda _: True, seconds=5.0):
        """The first message of a type from the vehicle from now on."""
        for _ in range(round(seconds / STEP)):
            found = [m for m in self.run(STEP) if isinstance(m, kind) and where(m)]
            if found:
                return found[0]
        raise AssertionError(f"no {kind.__name__} in {seconds:g} s")

    def ask(self, request, kind, where=lambda _: True, seconds=5.0):
        """The first answer to a request: a message of a type to this console."""
        self.send(request)
        return self.wait(kind, lambda m: m.dst == self.system and where(m), seconds)

    def calm(self):
        """End the circles that a simulated vehicle begins with."""
        self.wait(imc.PlanControlState, lambda state: state.state == imc.PlanControlState.State.EXECUTING, 60.0)
        self.run(30.0)  # an aircraft is in the air then
        self.ask(plan_control(imc.PlanControl.Op.STOP), imc.PlanControl)
        self.wait(imc.VehicleState, lambda state: state.op_mode == imc.VehicleState.OpMode.SERVICE, 60.0)

    def entity(self, message):
        return self.vehicle.entities.label(message.src, message.src_ent)


def plan_control(op, plan_id="", arg=None, request_id=9, flags=0):
    kind = imc.PlanControl
    return kind(type=kind.Type.REQUEST, op=op, plan_id=plan_id, arg=arg, request_id=request_id, flags=flags)
