"""A command that has subcommands, and does something without one."""

from typing import Any

import click

from shoal.cli import CommandGroup


class DefaultCommandGroup(CommandGroup):
    """Words that do not begin with the name of a subcommand are for the `default` one."""

    def __init__(self, *args: Any, default: str, **named: Any) -> None:
        super().__init__(*args, **named)
        self._default = default

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or (args[0] not in self.commands and args[0] not in self.get_help_option_names(ctx)):
            args = [self._default, *args]
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options of the default command, and the others."""
        click.Command.format_options(self.commands[self._default], ctx, formatter)
        others = [(name, each.get_short_help_str(90)) for name, each in self.commands.items() if name != self._default]
        with formatter.section("Commands"):
            formatter.write_dl(others)
