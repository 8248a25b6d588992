"""The command `shoal`."""

import atexit
import errno
import gc
import os
import sys
from difflib import get_close_matches
from importlib import import_module
from keyword import iskeyword
from typing import Any, ClassVar

import click
from click.shell_completion import CompletionItem, get_completion_class

from shoal.cli.package_conflicts import describe_conflict

COMMANDS = {
    "run": ("shoal.cli.run", "Run a vehicle profile."),
    "fleet": ("shoal.cli.fleet", "Start and watch many vehicles."),
    "mission": ("shoal.cli.mission", "Fly a plan in virtual time and report the result."),
    "test": ("shoal.cli.test", "Run scenarios, and report which failed, and why."),
    "campaign": ("shoal.cli.campaign", "Run a scenario many times with values that vary."),
    "replay": ("shoal.cli.replay", "Play back a log on the bus."),
    "resim": ("shoal.cli.resim", "Re-run tasks on a log and compare."),
    "rewind": ("shoal.cli.rewind", "Resume a virtual run from a given time in its log."),
    "ls": ("shoal.cli.ls", "List the vehicles on the network."),
    "spy": ("shoal.cli.spy", "Show the messages of a running vehicle, or their rates."),
    "record": ("shoal.cli.record", "Record what running vehicles send to a console."),
    "send": ("shoal.cli.send", "Send a message to a running vehicle."),
    "plan": ("shoal.cli.plan", "List, transfer, start and stop the plans of a running vehicle."),
    "param": ("shoal.cli.param", "Show, set and save the parameters of a running vehicle."),
    "link": ("shoal.cli.link_diagnosis", "Diagnose the connection to a vehicle: traffic both ways, drops, fixes."),
    "console": ("shoal.cli.console", "Show all vehicles in the browser, and command them."),
    "map": ("shoal.cli.map", "Import charts for the map in the browser."),
    "abort": ("shoal.cli.abort", "Send Abort to a running vehicle, and wait for confirmation."),
    "log": ("shoal.cli.log", "Show, fetch, cut, merge, compare, repair and export logs."),
    "check": ("shoal.cli.check", "Check profiles for mistakes."),
    "explain": ("shoal.cli.explain", "Show the values of a profile and where they are set."),
    "tasks": ("shoal.cli.tasks", "List tasks, or the parameters of one."),
    "message": ("shoal.cli.message", "Show the fields of a message."),
    "export": ("shoal.cli.export", "Write the files that other programs need for a vehicle."),
    "service": ("shoal.cli.service", "Write a systemd unit that runs a vehicle from boot on."),
    "new": ("shoal.cli.new", "Create a task, a driver, a vehicle or a scenario, with a test."),
}

GROUPS: dict[str, tuple[str, ...]] = {
    "Run and simulate": ("run", "mission", "test", "campaign", "fleet"),
    "Reach running vehicles": ("console", "ls", "spy", "record", "send", "plan", "param", "link", "abort"),
    "Use logs": ("log", "replay", "resim", "rewind"),
    "Look up and check": ("check", "explain", "tasks", "message"),
    "Create and install": ("new", "service", "export", "map"),
}
"""Commands by their use, as the help shows them."""

REMOTE = ("spy", "record", "send", "plan", "param", "link", "abort")
"""Commands whose first word is a vehicle."""
COMPLETE = "_SHOAL_COMPLETE"
"""The environment variable with which a shell asks for completions."""

STOPPED = 130
"""Exit status after Ctrl-C."""
WRONG_USE = 2
"""Exit status after a bad option, a missing or damaged file, a wrong profile; that of the answer *no* is 1."""


FEW = 12
"""Commands that an error can list."""
GARBAGE = 200_000
"""New objects after which Python looks for garbage: more than a start makes, which all stay. By default 700."""


class WrongUse(click.ClickException):
    """A mistake of the user that click does not check."""

    exit_code = WRONG_USE


class CommandGroup(click.Group):
    """Names the nearest command, or all if they are few, where there is no such command."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, Any, list[str]]:
        names = self.list_commands(ctx)
        if args and args[0] not in names:
            close = get_close_matches(args[0], names, 1)
            hint = f" Did you mean {close[0]}?" if close else ""
            if not close and len(names) <= FEW:
                hint = f" There are {', '.join(sorted(names))}."
            ctx.fail(f"no such command: {args[0]}.{hint}")
        return super().resolve_command(ctx, args)


class LazyGroup(CommandGroup):
    """Imports a command only when it is called; `table` maps names to (module, description)."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS
    groups: ClassVar[dict[str, tuple[str, ...]]] = {}

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Begin the command, unless other packages are in the place of Shoal's."""
        if parent is None and not extra.get("resilient_parsing") and (reason := describe_conflict()):
            raise WrongUse(reason)
        return super().make_context(info_name, args, parent, **extra)

    def main(self, *args: Any, **extra: Any) -> Any:
        """Begin the command; the shell gets most names without the imports of a command."""
        shell = os.environ.get(COMPLETE, "")
        if shell:
            from shoal.cli.shells import use_own_scripts  # not needed by commands

            use_own_scripts()
        if shell.endswith("_complete") and self.table is COMMANDS and _complete(self, shell.partition("_")[0]):
            sys.exit(0)
        return super().main(*args, **extra)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.table:
            return None
        return getattr(import_module(self.table[cmd_name][0]), cmd_name + "_" * iskeyword(cmd_name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for title, names in (self.groups or {"Commands": tuple(self.table)}).items():
            with formatter.section(title):
                formatter.write_dl([(name, self.table[name][1]) for name in names])

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a mistake, a file that cannot be read or written, and Ctrl-C end it with one line."""
        gc.set_threshold(GARBAGE)
        atexit.unregister(gc.freeze)
        atexit.register(gc.freeze)  # else Python looks for garbage in all that there is when the process ends
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:  # also while a command is imported
            click.echo("stopped", err=True)
            ctx.exit(STOPPED)
        except click.UsageError:
            raise
        except click.ClickException as error:
            raise WrongUse(error.format_message()) from None
        except OSError as error:
            if error.errno == errno.EPIPE:
                raise
            from support.file_errors import describe_os_error
            from support.terminal_text import printable  # slow to import, and rarely needed

            raise WrongUse(printable(describe_os_error(error))) from None


class MainGroup(LazyGroup):
    """The commands of `shoal`, listed by their use."""

    groups: ClassVar[dict[str, tuple[str, ...]]] = GROUPS


def _complete(group: click.Group, shell: str) -> bool:
    """Print what completes a word, if no import of a command is needed for it."""
    found = get_completion_class(shell)
    if found is None:
        return False
    completion = found(group, {}, "shoal", COMPLETE)
    words, incomplete = completion.get_completion_args()
    if not words:
        return False
    items: list[CompletionItem] | None
    if words[0] in REMOTE and len(words) == 1 and not incomplete.startswith("-"):
        from shoal.cli.recent_vehicles import recent_vehicles

        before, comma, last = incomplete.rpartition(",")
        names = [name for name in recent_vehicles() if name.lower().startswith(last.lower())]
        items = [CompletionItem(f"{before}{comma}{name}") for name in names] or None
    else:
        from shoal.cli.completion import complete_without_command

        items = complete_without_command(words, incomplete)
    for item in items or ():
        click.echo(completion.format_completion(item))
    return items is not None


@click.group(
    cls=MainGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="`shoal COMMAND --help` describes a command; docs/README.md in the sources lists the pages by role.",
)
@click.version_option(package_name="shoal")
def main() -> None:
    """A task runtime for unmanned vehicles."""
    if reconfigure := getattr(sys.stdout, "reconfigure", None):
        reconfigure(errors="replace")  # an ASCII terminal has no °
