"""Several vehicles of a fleet in one process, on one kernel; each has its own bus, zenoh session, tasks and log."""

import signal
from collections.abc import Iterable
from pathlib import Path

from runtime.kernel import WallClock, Watchdog
from runtime.profile import load_profile
from runtime.vehicle import Fleet, build, join_zenoh
from shoal.fleet.fleet_config import FleetVehicle
from shoal.fleet.parent_process import stop_with_parent


def run_shared_process(vehicles: Iterable[FleetVehicle], folder: Path, log_dir: Path, parent: int) -> None:
    """Run the vehicles until a signal, or until the process `parent` has gone. A task that fails is restarted.

    `folder` is that of the fleet file, where profiles are searched for first. Raises ProfileError, ConnectionError.
    """
    fleet = Fleet(WallClock())

    def stop(*_: object) -> None:
        fleet.kernel.post(fleet.stop)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
            signal.signal(number, stop)

    with Watchdog(fleet.kernel), fleet:
        state_folder = log_dir.parent / "db"
        for vehicle in vehicles:
            profile = load_profile(
                vehicle.profile, [folder], vehicle=vehicle.name, saved=state_folder, overrides=vehicle.overrides
            )
            made = build(
                profile,
                profile.parse_modes(vehicle.modes),
                fleet=fleet,
                seed=vehicle.seed,
                keep_going=True,
                log_root=log_dir,
                state_folder=state_folder,
            )
            join_zenoh(made.vehicle, profile)
        fleet.start()
        stop_with_parent(fleet.kernel, parent, fleet.stop)
        fleet.run()
