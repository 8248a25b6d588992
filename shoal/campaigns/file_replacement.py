"""Replaces files in one step."""

import contextlib
import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from support.atomic_files import commit_file


@contextmanager
def replace_file(path: Path) -> Generator[BinaryIO]:
    """A file to write to that replaces `path` at the end; after an error the old one is still there. Raises OSError."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(name, 0o644)
        commit_file(Path(name), path)
    except OSError as error:
        raise OSError(error.errno, os.strerror(error.errno) if error.errno else str(error), str(path)) from None
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
