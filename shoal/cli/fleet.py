"""`shoal fleet`: starts and watches the vehicles of a fleet file."""

import signal
import sys
import time
from pathlib import Path

import click
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from runtime.zenoh import key_chunk
from shoal.cli.console_tables import plain_table
from shoal.cli.options import add_user_task_folders, check_log_folder
from shoal.cli.time_texts import parse_duration_option
from shoal.cli.vehicle_subprocesses import shoal_command
from shoal.fleet import (
    FleetConfig,
    FleetMonitor,
    ManagedProcess,
    Supervisor,
    VehicleSummary,
    find_running_fleets,
    load_fleet,
    register_fleet,
    run_shared_process,
    stop_fleet,
)
from support.diagnostics import ProfileError
from support.terminal_text import printable

LOOK_PERIOD = 0.1  # s
ASK_PERIOD = 1.0  # s
LINE_PERIOD = 10.0  # s between lines in a pipe
OLD = 5.0  # s, age of a state that is shown


@click.command()
@click.argument("file", metavar="FLEET.yaml|stop")
@click.argument("name", required=False)
@click.option("--log-dir", type=click.Path(path_type=Path), help="Folder for logs [default: the file's, or log]")
@click.option("--for", "duration", callback=parse_duration_option, help="Stop after this time: 90s, 10min, 1h30min.")
@click.option("--crew", type=click.IntRange(0), hidden=True, help="Run the vehicles of one process.")
@click.option("--parent", type=int, hidden=True, help="End when this process has gone.")
def fleet(
    file: str, name: str | None, log_dir: Path | None, duration: float | None, crew: int | None, parent: int | None
) -> None:
    """Start and watch the vehicles of a FLEET.yaml, or stop a running fleet: shoal fleet stop [NAME]"""
    if file == "stop" and not Path(file).is_file():
        _stop(name)
        return
    if name is not None:
        raise click.UsageError(f"unexpected argument {name!r}: the name of a fleet is in its file")
    add_user_task_folders(())
    try:
        config = load_fleet(Path(file), log_dir)
        if crew is not None and parent is not None:
            run_shared_process(config.process_groups[crew], config.path.parent, config.log_dir, parent)
            return
        for warning in config.warnings:
            click.echo(warning, err=True)
        with register_fleet(config.name):
            sys.exit(_run(config, duration))
    except ModuleNotFoundError as error:
        raise click.ClickException(f"{error}; a fleet needs pip install 'shoal[zenoh]'") from None
    except ProfileError as error:
        raise click.ClickException(str(error)) from None
    except (ConnectionError, ValueError) as error:
        raise click.ClickException(printable(str(error))) from None


def _stop(name: str | None) -> None:
    found = find_running_fleets()
    if name is None and len(found) > 1:
        raise click.ClickException(f"several fleets run: {', '.join(found)}; name one")
    chosen = name or next(iter(found), "")
    if chosen not in found:
        others = f"; running: {', '.join(found)}" if found else ""
        raise click.ClickException(f"no fleet {chosen} runs{others}" if chosen else "no fleet runs")
    if not stop_fleet(chosen, found[chosen]):
        raise click.ClickException(f"the fleet {chosen}, process {found[chosen]}, does not end")
    click.echo(f"{chosen} stopped")


def _commands(config: FleetConfig) -> list[ManagedProcess]:
    """A process for each vehicle, or for each crew of several."""
    logs = ["--log-dir", str(config.log_dir)]
    if config.per_process > 1:
        return [
            ManagedProcess(
                crew[0].name if len(crew) == 1 else f"{crew[0].name} to {crew[-1].name}",
                shoal_command("fleet", str(config.path), *logs, "--crew", str(number)),
            )
            for number, crew in enumerate(config.process_groups)
        ]
    children: list[ManagedProcess] = []
    for vehicle in config.vehicles:
        modes = ["-p", vehicle.modes] if vehicle.modes else []
        seed = ["--seed", str(vehicle.seed), "-V", vehicle.name, "--bus", "zenoh", "--keep-going"]
        folder = ["-d", str(config.path.parent)]
        settings = [word for override in vehicle.overrides for word in ("--set", override)]
        children.append(
            ManagedProcess(
                vehicle.name, shoal_command("run", vehicle.profile, *modes, *seed, *folder, *logs, *settings)
            )
        )
    return children


def _run(config: FleetConfig, duration: float | None) -> int:
    """Start all, a little apart, and keep them; the exit status: 1 if one is down at the end."""
    children = _commands(config)
    supervisor = Supervisor([], restart=config.restart)
    ending: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
            signal.signal(number, lambda number, _: ending.append(number))
    names = [key_chunk(vehicle.name) for vehicle in config.vehicles]
    monitor = FleetMonitor(config.zenoh)
    display = _Display(config)
    try:
        monitor.check_names_free(names, find_running_fleets().keys() - {config.name})
        check_log_folder(config.log_dir)
        began = asked = time.monotonic()
        with display:
            while not ending and (duration is None or time.monotonic() - began < duration):
                now = time.monotonic()
                if children and now - began >= config.stagger * len(supervisor.processes):
                    supervisor.processes.append(children.pop(0))
                for child, words in supervisor.poll():
                    display.print_event(f"{child.name} {words}")
                for vehicle, words in monitor.new_errors():
                    if vehicle in names:
                        display.print_event(f"{vehicle} {words}")
                if supervisor.is_over and not children:
                    break
                if now - asked >= (ASK_PERIOD if display.is_live else LINE_PERIOD):
                    asked = now
                    display.show(monitor.running_vehicles(), monitor.query_summaries(), supervisor)
                time.sleep(LOOK_PERIOD)
        seconds = time.monotonic() - began
        crews = list(zip(supervisor.processes, config.process_groups, strict=False))
        failing = {vehicle.name for child, crew in crews if child.failures for vehicle in crew}
        done = {vehicle.name for child, crew in crews if child.ended_well for vehicle in crew}
        down = display.down(monitor.running_vehicles(), monitor.query_summaries(), failing, done)
    finally:
        supervisor.stop()
        monitor.close()
    display.end(seconds, down, failing, supervisor)
    return 1 if down else 0


class _Display:
    """One table on a terminal; events and a line now and then in a pipe."""

    def __init__(self, config: FleetConfig) -> None:
        self._config = config
        self._received: set[str] = set()
        self._console = Console(highlight=False, markup=False, emoji=False)
        self.is_live = self._console.is_terminal
        self._live = Live(console=self._console, auto_refresh=False, transient=True) if self.is_live else None

    def __enter__(self) -> "_Display":
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def print_event(self, words: str) -> None:
        self._console.print(Text(printable(f"{time.strftime('%H:%M:%S', time.gmtime())} {words}")), soft_wrap=True)

    def down(
        self, alive: set[str], summaries: dict[str, VehicleSummary], failing: set[str], done: set[str]
    ) -> list[str]:
        """Vehicles that are silent, or stopped after a start or a failure; without waiting and finished ones."""
        names = [vehicle.name for vehicle in self._config.vehicles if vehicle.name not in done]
        states = {name: self._state(key_chunk(name), alive, summaries) for name in names}
        once = {name for name in names if name in failing or key_chunk(name) in self._received}
        return [name for name, how in states.items() if how == "silent" or (how == "not running" and name in once)]

    def end(self, seconds: float, down: list[str], failing: set[str], supervisor: Supervisor) -> None:
        words = [f"{self._config.name} has ended after {seconds:.1f} s", _restarts(supervisor)]
        again = [vehicle.name for vehicle in self._config.vehicles if vehicle.name in failing.difference(down)]
        words += [f"down: {', '.join(down)}"] if down else []
        words += [f"restarted lately: {', '.join(again)}"] if again else []
        self.print_event(", ".join(words))

    def show(self, alive: set[str], summaries: dict[str, VehicleSummary], supervisor: Supervisor) -> None:
        if self._live is not None:
            self._live.update(self._table(alive, summaries, supervisor), refresh=True)
            return
        members = self._config.vehicles
        states = {vehicle.name: self._state(key_chunk(vehicle.name), alive, summaries) for vehicle in members}
        erring = [
            m.name for m in members if (summary := summaries.get(key_chunk(m.name))) is not None and summary.errors
        ]
        words = [f"{sum(not state for state in states.values())} of {len(members)} run"]
        for kind in dict.fromkeys(filter(None, states.values())):
            words.append(f"{kind}: {', '.join(name for name, state in states.items() if state == kind)}")
        words += [f"with errors: {', '.join(erring)}"] if erring else []
        self.print_event(f"STATUS  {'; '.join(words)}")

    def _state(self, name: str, alive: set[str], summaries: dict[str, VehicleSummary]) -> str:
        """Reason that keeps a vehicle (name as in keys) from running; "" if nothing."""
        if summaries.get(name, VehicleSummary()).age < OLD:
            self._received.add(name)
        elif name in alive:
            return "silent" if name in self._received else "starting"
        return "" if name in alive else "not running"

    def _table(self, alive: set[str], summaries: dict[str, VehicleSummary], supervisor: Supervisor) -> Table:
        table = plain_table("vehicle", "mode", "plan", "position", "battery", "errors", "age", right=("errors", "age"))
        for vehicle in self._config.vehicles:
            summary = summaries.get(key_chunk(vehicle.name), VehicleSummary())
            state = self._state(key_chunk(vehicle.name), alive, summaries)
            color = "red" if state == "not running" else "yellow" if state or summary.errors else ""
            age = f"{summary.age:.1f} s" if summary.age < 1e6 else "-"
            cells = (
                vehicle.name,
                state or summary.mode or "starting",
                summary.plan,
                summary.position,
                summary.battery,
                str(summary.errors),
                age,
            )
            table.add_row(*(Text(printable(cell)) for cell in cells), style=color)
        table.caption = f"{self._config.name}: {_restarts(supervisor)}; Ctrl-C stops"
        return table


def _restarts(supervisor: Supervisor) -> str:
    number = sum(child.restarts for child in supervisor.processes)
    return f"{number} restart{'s' * (number != 1)}"
