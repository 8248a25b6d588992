"""Logs of shipped profiles, and replays of logs that a ground station watches in virtual time."""

import imc
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.transports.mavlink_replay import MAVLinkReplay
from tasks.transports.replay import Replay
from tests.tasks.transports.mavlink_station import HOST, Station

SYSTEM = {"system": "replay", "system_id": 0x8123}


def record(folder, profile, seconds):
    """The folder of the last log of a run of a shipped profile; with that of its plan, if it starts one."""
    loaded = load_profile(profile)
    made = build(
        loaded,
        loaded.parse_modes(["Simulation"]),
        clock=parse_clock("virtual", loaded.start_time_ns),
        log_root=folder / "log",
        state_folder=folder / "db",
    )
    made.vehicle.start()
    made.vehicle.run(seconds)
    made.vehicle.close()
    return sorted(folder.glob("log/*/*/*"))[-1]


def show(log, script, *tasks, seconds=600.0, flavor="ardupilot", log_root=None, **values):
    """Replay a log to a station; `script(station, player)` must get through. Returns the run."""
    station, done = Station(None), []

    async def through(control):
        station.script = control
        await script(station, control.task.vehicle.task("Transports.Replay"))
        done.append(True)
        control.task.vehicle.stop()

    link = f"udpout://{HOST}:{station.port}?flavor={flavor}"
    both = [(Replay, {"load_at_start": str(log), **values}), (MAVLinkReplay, {"links": [link]})]
    try:
        run = simulate([*both, *tasks], seconds=seconds, script=through, log_root=log_root, **SYSTEM)
    finally:
        station.socket.close()
    assert done, "the script did not get through"
    return run


def position(value):
    """A message of a console that moves the replay to a second of the log."""
    entry = imc.EntityParameter(name="Position", value=str(value))
    return imc.SetEntityParameters(name="Replay", params=(entry,))
