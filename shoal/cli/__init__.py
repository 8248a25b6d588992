"""The command `shoal`."""

import sys
from difflib import get_close_matches
from importlib import import_module
from keyword import iskeyword
from pathlib import Path
from typing import Any, ClassVar

import click

COMMANDS = {
    "run": ("shoal.cli.run", "Run a vehicle profile."),
    "mission": ("shoal.cli.mission", "Fly a plan, as fast as the computer can, and say how it went."),
    "replay": ("shoal.cli.replay", "Play a log onto the bus."),
    "resim": ("shoal.cli.resim", "Run tasks again on a log, and compare."),
    "rewind": ("shoal.cli.rewind", "Go back in the log of a virtual run, and on from there."),
    "log": ("shoal.cli.log", "Look at logs, cut, merge, compare and repair them."),
    "check": ("shoal.cli.inspect", "Look for mistakes in profiles."),
    "explain": ("shoal.cli.inspect", "Say what each value of a profile is, means, and who set it."),
    "tasks": ("shoal.cli.inspect", "List the tasks, or one with its parameters."),
    "message": ("shoal.cli.inspect", "Describe a message by name or id."),
    "new": ("shoal.cli.new", "Make a task or a vehicle of your own, with a test."),
}


class LazyGroup(click.Group):
    """Imports a command when it is called, so that the others cost nothing; `table`: name -> (module, sentence)."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.table)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.table:
            return None
        return getattr(import_module(self.table[cmd_name][0]), cmd_name + "_" * iskeyword(cmd_name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in self.table.items()])

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[Any, Any, list[str]]:
        if args and args[0] not in self.table:
            close = get_close_matches(args[0], self.table, 1)
            hint = f" Did you mean {close[0]}?" if close else ""
            ctx.fail(f"no such command: {args[0]}.{hint}")
        return super().resolve_command(ctx, args)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="shoal")
def main() -> None:
    """A task runtime for unmanned vehicles."""
    if reconfigure := getattr(sys.stdout, "reconfigure", None):
        reconfigure(errors="replace")  # an ASCII terminal has no °
    sys.path.append(str(Path.cwd()))
