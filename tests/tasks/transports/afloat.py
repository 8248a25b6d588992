"""A shipped vehicle in virtual time, with links for ground stations that have sockets."""

import random

import imc
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port
from tests.tasks.transports.strict_peer import Line, Peer

STEP = 0.01  # s
LOG = random.Random(1).randbytes(20_000)


def earlier(folder, profile="lauv-noptilus-1"):
    """Make an earlier log of the vehicle."""
    log = folder / "log" / profile / "20230102/030405"
    log.mkdir(parents=True)
    (log / "Data.lsf").write_bytes(LOG)


def shipped_options(loaded):
    """What a profile sets for ground stations; in virtual time it has no links of its own."""

    def value(name, usual):
        return loaded.value("Transports.MAVLink", name) or usual

    return {
        "vehicle_kind": value("Vehicle Kind", "submarine"),
        "hold_radius": float(value("Hold Radius", "0")),
        "guided_speed": float(value("Guided Speed", "0")),
        "geoid_undulation": float(value("Geoid Undulation", "0")),
    }


class Afloat:
    """A shipped vehicle, by default the AUV, in virtual time, with a link for stations at `port`."""

    def __init__(self, folder, link="udpin://127.0.0.1:{port}?flavor=px4", profile="lauv-noptilus-1", **options):
        earlier(folder, profile)
        loaded = load_profile(profile, overrides=["Plan.Autostart:Enabled=Never"])
        options = {**shipped_options(loaded), **options}
        made = build(
            loaded,
            loaded.parse_modes(["Simulation"]),
            clock=parse_clock("virtual", loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        )
        self.vehicle, self.port, self.plans = made.vehicle, free_port(), []
        self.task = self.vehicle.add(MAVLink, "Transports.MAVLink", links=[link.format(port=self.port)], **options)
        self.vehicle.observe(imc.PlanControl, self.note)
        self.vehicle.start()
        self.vehicle.run(15.0)

    def note(self, message):
        if message.type == imc.PlanControl.Type.REQUEST and message.op == imc.PlanControl.Op.START:
            self.plans.append(message.plan_id)

    def line(self, **trouble):
        return Line(self.port, lambda: self.vehicle.run(STEP), lambda: self.vehicle.kernel.now_ns / 1e9, **trouble)

    def peer(self, line=None, *, system=255, **trouble):
        return Peer(line or self.line(**trouble), self.task.endpoint.model.system, system)
