"""Errors of the operating system that name the file."""

import os
from collections.abc import Generator
from contextlib import contextmanager


def describe_os_error(error: OSError, place: object = "") -> str:
    """A file and what is wrong with it, without the error number; `place` if the error names no file."""
    return ": ".join(str(part) for part in (error.filename or place, error.strerror or error) if part != "")


@contextmanager
def add_path_to_errors(path: object) -> Generator[None]:
    """Adds the path that is being written to an error of the operating system without one, as that of a full disk.

    An error with two paths, of a copy, names the one that is read.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None and error.filename2 is None:
            raise
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise OSError(error.errno, reason, str(path)) from error
