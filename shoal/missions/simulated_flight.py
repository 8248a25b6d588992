"""Builds the simulated vehicle of a profile and flies a plan with it."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import imc
from runtime.kernel import Clock, parse_clock
from runtime.profile import Profile, load_profile
from runtime.vehicle import Build, Fleet, build
from shoal.missions.mission import Mission
from shoal.missions.mission_context import profile_context
from shoal.missions.plan_file_reader import load_plan
from shoal.missions.report import Report
from shoal.simulated_motion import motion_problem
from support.diagnostics import ProfileError

USUAL_MODES = ("Simulation", "Kinematic")
AUTOSTART, LOGGER = "Plan.Autostart", "Transports.Logging"


def fly(
    plan: imc.PlanSpecification | Path,
    profile: str = "lauv-noptilus-1",
    modes: Sequence[str] = (),
    *,
    limit: float = 86400.0,
    overrides: Sequence[str] = (),
    config_dir: Sequence[Path] = (),
    seed: int | None = None,
    log_root: Path | None = None,
) -> Report:
    """Fly a plan, or the plan of a file, with the vehicle of a profile in virtual time, and return the report.

    `modes` defaults to Simulation, or else Kinematic; `overrides` are "Section:Option=value"; `limit` is in s of
    vehicle time. Without a `log_root` no log is written, and the report is the same. Exceptions of tasks are raised.
    """
    with tempfile.TemporaryDirectory() as folder:
        made = prepare(
            profile,
            modes,
            config_dir=config_dir,
            overrides=overrides,
            seed=seed,
            log_root=log_root,
            state_folder=Path(folder) / "db",
        )
        flown = made.vehicle.profile
        context = profile_context(flown) if isinstance(flown, Profile) else None
        specification = load_plan(plan, context) if isinstance(plan, Path) else plan
        return Mission(made.vehicle, specification).fly(limit)


def prepare(
    profile: str,
    modes: Sequence[str] = (),
    *,
    config_dir: Sequence[Path] = (),
    overrides: Sequence[str] = (),
    clock: Clock | str = "virtual",
    vehicle: str = "",
    fleet: Fleet | None = None,
    seed: int | None = None,
    log_root: Path | None = Path("log"),
    state_folder: Path = Path("db"),
) -> Build:
    """Build the vehicle of a profile for a mission; it starts no plan by itself.

    `modes` defaults to Simulation, or else Kinematic. `vehicle` replaces the name of the profile. In a `fleet` it uses
    the clock of the fleet. Without a `log_root` it writes no log. Raises ProfileError if the profile is wrong, or if
    the vehicle would stand still or be another one (`motion_problem`); FleetError if the name is taken.
    """
    loaded = load_profile(profile, tuple(config_dir), vehicle=vehicle, overrides=tuple(overrides))
    if AUTOSTART in loaded.config.sections:
        loaded.override(f"{AUTOSTART}:Enabled=Never")
    for section in list(loaded.config.sections) if log_root is None else ():
        if section.partition("/")[0] == LOGGER:
            loaded.override(f"{section}:Enabled=Never")
    chosen = parse_clock(clock, loaded.start_time_ns) if isinstance(clock, str) else clock
    made = build(
        loaded,
        parse_modes_or_default(loaded, modes),
        clock=chosen if fleet is None else None,
        fleet=fleet,
        seed=seed,
        log_root=log_root or state_folder / "log",
        state_folder=state_folder,
    )
    if problem := motion_problem(made, loaded):
        made.vehicle.close()
        raise ProfileError([problem])
    return made


def parse_modes_or_default(profile: Profile, modes: Sequence[str] = ()) -> frozenset[str]:
    """These modes of a profile; if there are none, Simulation or else Kinematic. Raises ProfileError."""
    return profile.parse_modes(list(modes) or [mode for mode in USUAL_MODES if mode in profile.selectable_modes][:1])
