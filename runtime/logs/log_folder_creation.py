"""Writes the folder of a log: unchanged packets, and their definitions."""

import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import imc
from imc.lsf import LsfWriter, compress_member, gzip_schema
from support.atomic_files import new_folder
from support.file_errors import add_path_to_errors

SCHEMA = "IMC.xml.gz"
DATA = "Data.lsf.gz"


@contextmanager
def create_log(folder: Path, source: imc.Log | None = None) -> Generator[LsfWriter]:
    """A new log folder with the definitions of `source` (built-in ones without it), and the writer of its packets.

    The folder has this name when the log is complete and on the disk: if anything fails, the process is killed or the
    power fails before, there is none. Raises FileExistsError if it exists already, OSError.
    """
    with new_folder(folder) as part:
        with add_path_to_errors(folder):
            (part / SCHEMA).write_bytes(schema_bytes(source))
            if source is not None and (config := source.path.parent / "Config.ini").is_file():
                shutil.copyfile(config, part / config.name)
        with _named(part / DATA, folder / DATA):
            writer = LsfWriter(part / DATA)
            try:
                yield writer
            finally:
                writer.close()


@contextmanager
def _named(part: Path, path: Path) -> Generator[None]:
    """Replaces the path in errors of a temporary file by its final path."""
    try:
        yield
    except OSError as error:
        if error.filename != str(part):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def schema_bytes(source: imc.Log | None) -> bytes:
    """The definitions of a log as IMC.xml.gz; those of its own file, if it has one."""
    if source is None or source.schema_source is None:
        return gzip_schema(source.schema if source else imc.builtin())
    data = source.schema_source.read_bytes()
    return data if data.startswith(b"\x1f\x8b") else compress_member(data, level=9)
