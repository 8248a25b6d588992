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

from runtime.problem import ProfileError, printable
from runtime.zenoh import chunk
from shoal.cli.options import check_log_folder, parse_time, use_code
from shoal.cli.processes import command
from shoal.cli.tables import plain_table
from shoal.fleet import Child, Keeper, Roster, View, Watch, end, load_roster, noted, run_crew, running

LOOK_PERIOD = 0.1  # s
ASK_PERIOD = 1.0  # s
LINE_PERIOD = 10.0  # s between lines in a pipe
OLD = 5.0  # s, age of a state that is shown


@click.command()
@click.argument("file", metavar="FLEET.yaml|stop")
@click.argument("name", required=False)
@click.option("--log-dir", type=click.Path(path_type=Path), help="Folder for logs [default: the file's, or log]")
@click.option("--for", "duration", callback=parse_time, help="Stop after this time: 90s, 10min, 1h30min.")
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
    use_code(())
    try:
        roster = load_roster(Path(file), log_dir)
        if crew is not None and parent is not None:
            run_crew(roster.crews[crew], roster.path.parent, roster.log_dir, parent)
            return
        for warning in roster.warnings:
            click.echo(warning, err=True)
        with noted(roster.name):
            sys.exit(_run(roster, duration))
    except ModuleNotFoundError as error:
        raise click.ClickException(f"{error}; a fleet needs pip install 'shoal[zenoh]'") from None
    except ProfileError as error:
        raise click.ClickException(str(error)) from None
    except (ConnectionError, ValueError) as error:
        raise click.ClickException(printable(str(error))) from None


def _stop(name: str | None) -> None:
    found = running()
    if name is None and len(found) > 1:
        raise click.ClickException(f"several fleets run: {', '.join(found)}; name one")
    chosen = name or next(iter(found), "")
    if chosen not in found:
        others = f"; running: {', '.join(found)}" if found else ""
        raise click.ClickException(f"no fleet {chosen} runs{others}" if chosen else "no fleet runs")
    if not end(chosen, found[chosen]):
        raise click.ClickException(f"the fleet {chosen}, process {found[chosen]}, does not end")
    click.echo(f"{chosen} stopped")


def _commands(roster: Roster) -> list[Child]:
    """A process for each vehicle, or for each crew of several."""
    logs = ["--log-dir", str(roster.log_dir)]
    if roster.per_process > 1:
        return [
            Child(
                crew[0].name if len(crew) == 1 else f"{crew[0].name} to {crew[-1].name}",
                command("fleet", str(roster.path), *logs, "--crew", str(number)),
            )
            for number, crew in enumerate(roster.crews)
        ]
    children: list[Child] = []
    for member in roster.members:
        modes = ["-p", member.modes] if member.modes else []
        seed = ["--seed", str(member.seed), "-V", member.name, "--bus", "zenoh", "--keep-going"]
        folder = ["-d", str(roster.path.parent)]
        settings = [word for override in member.overrides for word in ("--set", override)]
        children.append(Child(member.name, command("run", member.profile, *modes, *seed, *folder, *logs, *settings)))
    return children


def _run(roster: Roster, duration: float | None) -> int:
    """Start all, a little apart, and keep them; the exit status: 1 if one has failed for good."""
    children = _commands(roster)
    keeper = Keeper([], restart=roster.restart)
    ending: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
            signal.signal(number, lambda number, _: ending.append(number))
    names = [chunk(member.name) for member in roster.members]
    watch = Watch(roster.zenoh)
    display = _Display(roster)
    try:
        watch.claim(names, running().keys() - {roster.name})
        check_log_folder(roster.log_dir)
        began = asked = time.monotonic()
        with display:
            while not ending and (duration is None or time.monotonic() - began < duration):
                now = time.monotonic()
                if children and now - began >= roster.stagger * len(keeper.children):
                    keeper.children.append(children.pop(0))
                for child, words in keeper.look():
                    display.tell(f"{child.name} {words}")
                for vehicle, words in watch.errors():
                    if vehicle in names:
                        display.tell(f"{vehicle} {words}")
                if keeper.done and not children:
                    break
                if now - asked >= (ASK_PERIOD if display.is_live else LINE_PERIOD):
                    asked = now
                    display.show(watch.alive(), watch.ask(), keeper)
                time.sleep(LOOK_PERIOD)
    finally:
        keeper.stop()
        watch.close()
    return 1 if any(child.failures for child in keeper.children) and not roster.restart else 0


class _Display:
    """One table on a terminal; events and a line now and then in a pipe."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
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

    def tell(self, words: str) -> None:
        self._console.print(Text(printable(f"{time.strftime('%H:%M:%S', time.gmtime())} {words}")), soft_wrap=True)

    def show(self, alive: set[str], views: dict[str, View], keeper: Keeper) -> None:
        if self._live is not None:
            self._live.update(self._table(alive, views, keeper), refresh=True)
            return
        members = self._roster.members
        run = sum(chunk(member.name) in alive for member in members)
        seen = [views[chunk(member.name)] for member in members if chunk(member.name) in views]
        erring = sum(view.errors > 0 for view in seen)
        oldest = max((view.age for view in seen), default=0.0)
        self.tell(f"STATUS  {run} of {len(members)} run, {erring} with errors, oldest state {oldest:.1f} s")

    def _table(self, alive: set[str], views: dict[str, View], keeper: Keeper) -> Table:
        table = plain_table("vehicle", "mode", "plan", "position", "battery", "errors", "age", right=("errors", "age"))
        for member in self._roster.members:
            view = views.get(chunk(member.name), View())
            runs = chunk(member.name) in alive
            mode = view.mode if runs else "not running"
            colour = "" if runs and not view.errors and view.age < OLD else "yellow" if runs else "red"
            age = f"{view.age:.1f} s" if view.age < 1e6 else "-"
            cells = (member.name, mode or "starting", view.plan, view.place, view.battery, str(view.errors), age)
            table.add_row(*(Text(printable(cell)) for cell in cells), style=colour)
        restarts = sum(child.restarts for child in keeper.children)
        table.caption = f"{self._roster.name}: {restarts} restarts; Ctrl-C stops"
        return table
