"""`shoal service`: writes a systemd unit that runs a vehicle from boot on."""

import os
import re
import shlex
import sys
from pathlib import Path

import click

from runtime.profile import load_profile
from runtime.vehicle import check_profile, find_task, missing_extra_problem
from shoal.cli.completion import complete_profile
from shoal.cli.options import (
    add_user_task_folders,
    code_option,
    config_dir_option,
    modes_option,
    overrides_option,
    require_text,
)
from shoal.cli.vehicle_subprocesses import resolve_process_option
from support.atomic_files import write_output
from support.diagnostics import ProfileError
from support.terminal_text import quoted

STATE = Path("/var/lib/shoal")
WATCHDOG = 15  # s; the run itself breaks a handler after 5 s
CLOCK = 30  # s
HOMES = (Path("/home"), Path("/root"))
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._~-]{0,99}")  # nothing that systemd or a shell expands
HIDDEN = (*HOMES, Path("/tmp"), Path("/var/tmp"))

UNIT = """\
# {vehicle}: a vehicle of Shoal that runs from boot on. Written by `{command}`.

[Unit]
Description=Shoal vehicle {vehicle}
Wants=network.target
After=network.target time-set.target local-fs.target
# A vehicle is always started again, however often it has failed.
StartLimitIntervalSec=0

[Service]
Type=notify
WorkingDirectory={working}
{wait}ExecStart={start}
Restart=always
RestartSec=2
# The thread that runs all tasks notifies the watchdog; if it hangs, the run is killed and started again.
WatchdogSec={watchdog}
TimeoutStartSec=120
TimeoutStopSec=15
User={user}
SupplementaryGroups={groups}
UMask=0022
Environment=PYTHONUNBUFFERED=1
OOMScoreAdjust=-500
LimitCORE=0
# Frames of cameras go to other processes through shared memory, which zenoh locks: 6 of each size.
LimitMEMLOCK=256M

# What it may write, and do. Devices stay visible, since one that is plugged in later must be found: who may open them
# is a matter of their group.
{writable}
RuntimeDirectory=shoal-{vehicle}
RuntimeDirectoryPreserve=restart
ProtectSystem=strict
ProtectHome={home}
PrivateTmp=yes
NoNewPrivileges=yes
CapabilityBoundingSet=
AmbientCapabilities=
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectProc=invisible
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
LockPersonality=yes
RemoveIPC=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallErrorNumber=EPERM

[Install]
WantedBy=multi-user.target
"""
WAIT = """\
# At boot, not at each start: give the clock a while to be set. Without a network it then starts all the same.
ExecStartPre=-/bin/sh -c 'test -e /run/shoal-{vehicle}/waited || timeout {seconds} sh -c \
"until timedatectl show -p NTPSynchronized | grep -q yes; do sleep 1; done"; touch /run/shoal-{vehicle}/waited'
"""


@click.command()
@click.argument("profile", shell_complete=complete_profile)
@config_dir_option
@modes_option
@click.option("-V", "--vehicle", callback=require_text, help="Name of the vehicle, instead of the profile's.")
@overrides_option
@code_option
@click.option(
    "--bus", type=click.Choice(["inprocess", "zenoh"]), help="Bus to use instead of the profile's [default: inprocess]"
)
@click.option("--process", metavar="NAME", help="Run only the sections with this Process; main for those without one.")
@click.option("--alone", is_flag=True, help="Do not start the other processes: they run on other computers.")
@click.option("--user", default="shoal", show_default=True, help="User that runs the vehicle.")
@click.option(
    "--group", "groups", multiple=True, default=("dialout",), show_default=True, help="Group whose devices it may use."
)
@click.option(
    "--log-dir",
    default=str(STATE / "log"),
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder for logs; saved parameters and plans are in db beside it.",
)
@click.option(
    "--wait-for-clock",
    default=CLOCK,
    show_default=True,
    type=click.IntRange(0, 100),
    metavar="SECONDS",
    help="Longest wait at boot until the clock is set; 0 is none.",
)
@click.option("--force", is_flag=True, help="Replace a file that differs.")
@click.option("-o", "--output", help="File to write, - for the terminal  [default: shoal-VEHICLE[-PROCESS].service]")
def service(
    profile: str,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    vehicle: str,
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
    bus: str | None,
    process: str | None,
    alone: bool,
    user: str,
    groups: tuple[str, ...],
    log_dir: Path,
    wait_for_clock: int,
    force: bool,
    output: str | None,
) -> None:
    """Write a systemd unit that runs the vehicle PROFILE from boot on; see docs/deploy.md.

    The unit runs `shoal run` with the same options in the present folder.
    """
    for word in (user, *groups):
        if not re.fullmatch(r"[a-z_][a-z0-9_-]{0,30}", word):
            raise click.BadParameter(f"{word!r} is not the name of a user or group")
    if not log_dir.is_absolute():
        raise click.BadParameter(
            f"{log_dir} is not absolute: a service has no folder of its own", param_hint="--log-dir"
        )
    add_user_task_folders(code, [profile])
    try:
        loaded = load_profile(profile, config_dir, vehicle=vehicle, overrides=overrides)
        selected = loaded.parse_modes(profiles)
        problems = check_profile(loaded, {}, selected, find_task)
        if errors := [problem for problem in problems if problem.severity == "error"]:
            raise ProfileError(errors)
        part = resolve_process_option(process, loaded.processes(selected), (bus or loaded.bus_transport) == "zenoh")
    except (ProfileError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    sections = [
        section.name for section in loaded.config.sorted_sections() if loaded.is_task_enabled(section.name, selected)
    ]
    apart = part is not None and (alone or process is not None)
    enabled = [section for section in sections if not apart or loaded.task_process(section) == part]
    if not enabled:
        modes = ", ".join(sorted(loaded.selectable_modes))
        raise click.ClickException(f"{loaded.name} has nothing to run without a mode; select one with -p: {modes}")
    for section in enabled:
        found = find_task(section)
        if found is not None and (problem := missing_extra_problem(found, loaded.config.sections[section])):
            if problem.severity == "error":
                raise click.ClickException(str(problem))
            click.echo(str(problem), err=True)

    options = [word for mode in profiles for word in ("-p", mode)]
    options += ["-V", vehicle] if vehicle else []
    options += [word for folder in config_dir for word in ("-d", str(folder.resolve()))]
    options += [word for folder in code for word in ("--code", str(folder.resolve()))]
    options += [word for override in overrides for word in ("--set", override)]
    options += ["--bus", bus] if bus is not None else []
    options += ["--process", process] if process is not None else []
    options += ["--alone"] if alone else []
    options += ["--log-dir", str(log_dir)]
    source = str(Path(profile).resolve()) if Path(profile).is_file() else profile
    # An environment may have its Python elsewhere, and Shoal its sources.
    program = {Path(sys.prefix), Path(sys.base_prefix), Path(sys.executable).resolve(), Path(__file__).parents[2]}
    folders = [Path.cwd(), *sorted(program), *config_dir, *code]
    if hidden := [folder for folder in folders if any(folder.absolute().is_relative_to(place) for place in HIDDEN)]:
        words = ", ".join(map(str, hidden))
        click.echo(f"warning: the service or its user {user} may not see {words}: use /opt or /etc instead", err=True)
    name = f"{loaded.vehicle}-{part}" if part else loaded.vehicle
    if not NAME.fullmatch(name):
        words = f"{quoted(name)} cannot be in the name of a service; use letters, digits, '.', '_', '~' and '-'"
        raise click.ClickException(f"{words}: -V NAME names the vehicle")
    for word in (str(Path.cwd()), source, *_program(), *options):
        if not word.isprintable():
            raise click.ClickException(f"{quoted(word)} has a line break or another control character: rename it")
    text = UNIT.format(
        vehicle=name,
        command=" ".join(map(shlex.quote, ["shoal", "service", profile, *options])),
        working=_escaped(str(Path.cwd())),
        wait=WAIT.format(vehicle=name, seconds=wait_for_clock) if wait_for_clock else "",
        start=" ".join(map(quote_for_systemd, [*_program(), "run", source, *options])),
        watchdog=WATCHDOG,
        user=user,
        groups=" ".join(groups),
        writable=_writable(log_dir),
        home="read-only" if any(_in_home(folder) for folder in folders) else "yes",
    )
    if output == "-":
        click.echo(text, nl=False)
        return
    path = Path(output or f"shoal-{name}.service")
    if not force and path.exists() and path.read_bytes() != text.encode():
        raise click.ClickException(f"{path} exists, differs and was not changed; --force replaces it")
    write_output(path, text.encode())
    click.echo(f"wrote {path}\n")
    click.echo("Install it, as root:")
    click.echo(f"  useradd --system --home-dir {STATE} --shell /usr/sbin/nologin {user}    (once)")
    click.echo(f"  cp {shlex.quote(str(path))} /etc/systemd/system/ && systemctl daemon-reload")
    click.echo(f"  systemctl enable --now shoal-{name}")
    click.echo(f"Look at it:  systemctl status shoal-{name}    journalctl -fu shoal-{name}")


def quote_for_systemd(word: str) -> str:
    """A word of a command line of systemd: no specifier, no variable, no quote of it has a meaning."""
    return _word(_escaped(word).replace("$", "$$"))


def _word(plain: str) -> str:
    if plain and re.fullmatch(r"[\w@%+=:,./$-]+", plain):
        return plain
    inner = plain.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("\t", "\\t")
    return f'"{inner}"'


def _escaped(word: str) -> str:
    return word.replace("%", "%%")


def _program() -> list[str]:
    """The command that runs Shoal as it runs here."""
    beside = Path(sys.executable).parent / "shoal"
    return [str(beside)] if beside.is_file() and os.access(beside, os.X_OK) else [sys.executable, "-m", "shoal.cli"]


def _writable(log_dir: Path) -> str:
    """Logs, and what is kept beside them."""
    if log_dir.parent == STATE:
        return f"StateDirectory={STATE.name}"
    return f"ReadWritePaths={_word('-' + _escaped(str(log_dir.parent)))}"


def _in_home(folder: Path) -> bool:
    """Whether a folder is one of a user, which the service then has to see."""
    return any(folder.absolute().is_relative_to(home) for home in HOMES)
