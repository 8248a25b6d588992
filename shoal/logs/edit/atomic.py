"""Writes files and folders completely or not at all."""

import os
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from support.file_errors import naming_path


@contextmanager
def new_file(path: Path, force: bool = False) -> Generator[Path]:
    """A temporary path to write to; renamed to `path` on success, else removed.

    Raises FileExistsError if `path` exists, unless it is a file and `force` is set.
    """
    _refuse(path, force and not path.is_dir())
    part = path.with_name(path.name + ".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with naming_path(path):
            yield part
            os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path, force: bool = False) -> Generator[Path]:
    """A temporary folder to write to, like `new_file`.

    With `force`, new files replace those of the same name in an existing folder; other files stay.
    """
    _refuse(path, force and path.is_dir())
    part = path.with_name(path.name + ".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        with naming_path(path):
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
        raise FileExistsError(17, "already exists", str(path))
