"""Commands that need an extra of Shoal report a missing one."""

from collections.abc import Generator
from contextlib import contextmanager

import click


@contextmanager
def require_extra(name: str) -> Generator[None]:
    """Turns a missing library into the advice to install an extra of Shoal."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise click.ClickException(f"this needs {error.name}: pip install 'shoal[{name}]'") from None
