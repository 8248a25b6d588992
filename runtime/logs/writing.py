"""Writes the folder of a log: packets as they are, and the definitions that belong to them."""

import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import imc
from imc.lsf import LsfWriter, gzip_member

SCHEMA = "IMC.xml.gz"
DATA = "Data.lsf.gz"


@contextmanager
def new_log(folder: Path, source: imc.Log | None = None) -> Generator[LsfWriter]:
    """A new folder with the definitions of `source` (of this version without one); what is written goes to its data.

    Where it fails, nothing is left behind. Raises FileExistsError where there is something already, OSError.
    """
    folder.mkdir(parents=True)
    try:
        (folder / SCHEMA).write_bytes(schema_bytes(source))
        if source is not None and (config := source.path.parent / "Config.ini").is_file():
            shutil.copyfile(config, folder / config.name)
        writer = LsfWriter(folder / DATA)
        try:
            yield writer
        finally:
            writer.close()
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def schema_bytes(source: imc.Log | None) -> bytes:
    """The definitions of a log as IMC.xml.gz: its own file, byte for byte, where it has one."""
    if source is None or source.schema_source is None:
        return gzip_member(imc.dump(source.schema if source else imc.builtin()), level=9)
    data = source.schema_source.read_bytes()
    return data if data.startswith(b"\x1f\x8b") else gzip_member(data, level=9)
