"""Fixtures that write logs."""

from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

import imc
from imc.lsf import LsfWriter, gzip_member

DEFINITIONS = gzip_member(imc.dump(imc.builtin()))


@pytest.fixture
def make_log(tmp_path: Path) -> Callable[..., Path]:
    """Writes messages or packets to a log folder in the test's temporary folder."""

    def make(
        content: Iterable[imc.Message | bytes],
        name: str = "log",
        schema: bytes | None = DEFINITIONS,
        compression: str = "gzip",
        block: int = 1 << 17,
    ) -> Path:
        folder = tmp_path / name
        folder.mkdir(parents=True)
        if schema is not None:
            (folder / "IMC.xml.gz").write_bytes(schema)
        suffix = {"gzip": ".gz", "bzip2": ".bz2", "zlib": ".z", "none": ""}[compression]
        writer = LsfWriter(folder / f"Data.lsf{suffix}", compression, block)
        for item in content:
            writer.write(item if isinstance(item, bytes) else imc.encode(item))
        writer.close()
        return folder

    return make
