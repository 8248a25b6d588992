"""Writes files whole or not at all, also if the power fails in between."""

import contextlib
import errno
import glob
import os
import secrets
import shutil
import stat
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from support.file_errors import add_path_to_errors

IRREPLACEABLE = (errno.EBUSY, errno.EACCES)  # mounted by itself into a container, or in a folder of somebody else
STALE = 3600.0  # s; a temporary file of this age belongs to a program that was killed, or to a power cut


def write_file(path: Path, data: bytes, mode: int | None = None) -> None:
    """Replace the content of a file by `data`, like `replace_file`; missing folders are made."""
    make_folder(path.parent)
    with replace_file(path, mode) as file:
        file.write(data)


def write_output(path: Path, data: bytes) -> None:
    """Write a file that a user names, like `replace_file`; a device or a pipe gets the data as they are.

    A file that exists keeps its permissions, a link its target; one that cannot be replaced is overwritten. Raises
    OSError that names the file.
    """
    with add_path_to_errors(path):
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        place = path.resolve() if path.is_symlink() else path
        mode = stat.S_IMODE(place.stat().st_mode) if place.exists() else None
        if mode is not None and not os.access(place, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        try:
            with replace_file(place, mode) as file:
                file.write(data)
        except OSError as error:
            if mode is None or error.errno not in IRREPLACEABLE:
                raise
            place.write_bytes(data)


@contextmanager
def replace_file(path: Path, mode: int | None = None, *, durable: bool = True) -> Generator[BinaryIO]:
    """A file to write to, which becomes `path` at the end; after an error, `path` has its old content.

    Afterward the content is on the disk, and after a power cut it is the old or the new one, whole; without `durable`
    this holds for the end of the process only, which takes no time. `mode` is the permissions, by default what the
    umask leaves. Several may replace the same file at once: the last one wins. Raises OSError that names `path`.
    """
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    try:
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode or 0o666), "wb") as file:
            if mode is not None:
                os.chmod(part, mode)
            _remove_stale_parts(path, os.fstat(file.fileno()).st_mtime)
            yield file
        if durable:
            _commit(part, path)
        else:
            os.replace(part, path)
    except OSError as error:
        if error.filename not in (None, str(part)):
            raise
        raise OSError(error.errno, os.strerror(error.errno) if error.errno else str(error), str(path)) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def _remove_stale_parts(path: Path, now: float) -> None:
    """Remove the temporary files that earlier programs have left beside a file, at a time of its file system (s)."""
    for part in path.parent.glob(f"{glob.escape(path.name)}.{'[0-9a-f]' * 8}.part"):
        with contextlib.suppress(OSError):
            if now - part.stat().st_mtime > STALE:
                part.unlink()


def _commit(part: Path, path: Path) -> None:
    """Rename a file that is written: also after a power cut, `path` has its old content or that of `part`, whole."""
    descriptor = os.open(part, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    os.replace(part, path)
    sync_path(path.parent)


def remove_file(path: Path) -> None:
    """Remove a file, if it is there, for good. Raises OSError that names the path."""
    with contextlib.suppress(FileNotFoundError):
        path.unlink()
        sync_path(path.parent)


@contextmanager
def new_file(path: Path, force: bool = False) -> Generator[Path]:
    """A temporary path to write to; renamed to `path` on success, else removed.

    Raises FileExistsError if `path` exists, unless it is a file and `force` is set.
    """
    _refuse(path, force and not path.is_dir())
    part = path.with_name(path.name + ".part")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with add_path_to_errors(path):
            yield part
            _commit(part, path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def new_folder(path: Path, force: bool = False) -> Generator[Path]:
    """A temporary folder to write to, like `new_file`.

    With `force`, new files replace those of the same name in an existing folder; other files stay. Of several that
    write to the same folder at once, the first one has it. Raises OSError that names `path`. Files in the folder
    itself are on the disk afterwards; those in its folders, which may be thousands, when the system writes them.
    """
    _refuse(path, force and path.is_dir())
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    try:
        part.mkdir(parents=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    _remove_stale_folders(path, part.stat().st_mtime)
    try:
        with add_path_to_errors(path):
            yield part
            _refuse(path, force and path.is_dir())
            if path.is_dir():
                for file in part.iterdir():
                    if file.is_file():
                        _commit(file, path / file.name)
                    else:
                        os.replace(file, path / file.name)
            else:
                for file in part.iterdir():
                    if file.is_file():
                        sync_path(file)
                sync_path(part)
                os.replace(part, path)
                sync_path(path.parent)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _remove_stale_folders(path: Path, now: float) -> None:
    """Remove the temporary folders of killed programs in which nothing was written for `STALE`, at a time (s)."""
    for part in path.parent.glob(f"{glob.escape(path.name)}.{'[0-9a-f]' * 8}.part"):
        with contextlib.suppress(OSError):
            if now - max(each.stat().st_mtime for each in (part, *part.rglob("*"))) > STALE:
                shutil.rmtree(part, ignore_errors=True)


def make_folder(folder: Path) -> None:
    """Make a folder and its missing parents, which are on the disk afterward. Raises OSError."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        sync_path(folder.parent)


def sync_path(path: Path) -> None:
    """Put a file, or the names in a folder, on the disk, where the system can. Raises OSError that names the path."""
    if os.name != "posix":
        return
    with add_path_to_errors(path):
        try:
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EACCES):  # network drives; not ours to read
                raise


def _refuse(path: Path, allowed: bool) -> None:
    if os.path.lexists(path) and not allowed:
        raise FileExistsError(errno.EEXIST, "already exists", str(path))
