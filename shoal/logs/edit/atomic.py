"""Files that appear whole or not at all."""

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def new_file(path: Path, force: bool = False) -> Generator[Path]:
    """A path to write to; the file gets its name when all went well, else it is removed.

    Raises FileExistsError where there is something of that name, unless `force` says to replace a file.
    """
    _refuse(path, force and not path.is_dir())
    part = path.with_name(path.name + ".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path, force: bool = False) -> Generator[Path]:
    """A new, empty folder to write to, as `new_file`.

    With `force`, files in an existing folder are replaced by those of the same name, and others stay.
    """
    _refuse(path, force and path.is_dir())
    part = path.with_name(path.name + ".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        yield part
        if path.is_dir():
            for file in part.iterdir():
                os.replace(file, path / file.name)
        else:
            os.replace(part, path)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _refuse(path: Path, allowed: bool) -> None:
    if os.path.lexists(path) and not allowed:
        raise FileExistsError(17, "it exists already", str(path))
