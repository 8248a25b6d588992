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

from runtime.zenoh import chunk
from shoal.cli.options import check_log_folder, parse_time, use_code
from shoal.cli.processes import command
from shoal.cli.tables import plain_table
from shoal.fleet import Child, Keeper, Roster, View, Watch, end, load_roster, noted, run_crew, running
from support.diagnostics import ProfileError
from support.text import printable

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
    """Start all, a little apart, and keep them; the exit status: 1 if one is down at the end."""
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
        seconds = time.monotonic() - began
        crews = list(zip(keeper.children, roster.crews, strict=False))
        failing = {member.name for child, crew in crews if child.failures for member in crew}
        done = {member.name for child, crew in crews if child.ended_well for member in crew}
        down = display.down(watch.alive(), watch.ask(), failing, done)
    finally:
        keeper.stop()
        watch.close()
    display.end(seconds, down, failing, keeper)
    return 1 if down else 0


class _Display:
    """One table on a terminal; events and a line now and then in a pipe."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
        self._heard: set[str] = set()
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

    def down(self, alive: set[str], views: dict[str, View], failing: set[str], done: set[str]) -> list[str]:
        """Who is silent, or has run or failed and does not run; not who has not started yet, or has done its work."""
        names = [member.name for member in self._roster.members if member.name not in done]
        states = {name: self._state(chunk(name), alive, views) for name in names}
        once = {name for name in names if name in failing or chunk(name) in self._heard}
        return [name for name, how in states.items() if how == "silent" or (how == "not running" and name in once)]

    def end(self, seconds: float, down: list[str], failing: set[str], keeper: Keeper) -> None:
        words = [f"{self._roster.name} has ended after {seconds:.1f} s", _restarts(keeper)]
        again = [member.name for member in self._roster.members if member.name in failing.difference(down)]
        words += [f"down: {', '.join(down)}"] if down else []
        words += [f"restarted lately: {', '.join(again)}"] if again else []
        self.tell(", ".join(words))

    def show(self, alive: set[str], views: dict[str, View], keeper: Keeper) -> None:
        if self._live is not None:
            self._live.update(self._table(alive, views, keeper), refresh=True)
            return
        members = self._roster.members
        states = {member.name: self._state(chunk(member.name), alive, views) for member in members}
        erring = [m.name for m in members if (view := views.get(chunk(m.name))) is not None and view.errors]
        words = [f"{sum(not state for state in states.values())} of {len(members)} run"]
        for kind in dict.fromkeys(filter(None, states.values())):
            words.append(f"{kind}: {', '.join(name for name, state in states.items() if state == kind)}")
        words += [f"with errors: {', '.join(erring)}"] if erring else []
        self.tell(f"STATUS  {'; '.join(words)}")

    def _state(self, name: str, alive: set[str], views: dict[str, View]) -> str:
        """What keeps a vehicle (name as in keys) from running; "" if nothing."""
        if views.get(name, View()).age < OLD:
            self._heard.add(name)
        elif name in alive:
            return "silent" if name in self._heard else "starting"
        return "" if name in alive else "not running"

    def _table(self, alive: set[str], views: dict[str, View], keeper: Keeper) -> Table:
        table = plain_table("vehicle", "mode", "plan", "position", "battery", "errors", "age", right=("errors", "age"))
        for member in self._roster.members:
            view = views.get(chunk(member.name), View())
            state = self._state(chunk(member.name), alive, views)
            colour = "red" if state == "not running" else "yellow" if state or view.errors else ""
            age = f"{view.age:.1f} s" if view.age < 1e6 else "-"
            cells = (
                member.name,
                state or view.mode or "starting",
                view.plan,
                view.place,
                view.battery,
                str(view.errors),
                age,
            )
            table.add_row(*(Text(printable(cell)) for cell in cells), style=colour)
        table.caption = f"{self._roster.name}: {_restarts(keeper)}; Ctrl-C stops"
        return table


def _restarts(keeper: Keeper) -> str:
    number = sum(child.restarts for child in keeper.children)
    return f"{number} restart{'s' * (number != 1)}"
