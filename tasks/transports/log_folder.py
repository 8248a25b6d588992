"""The folder of a log that is being written, in DUNE's layout."""

import errno
import shutil
from pathlib import Path

import imc
from imc.lsf import COMPRESSIONS, LsfWriter, gzip_member


class LogFolder:
    """One log on disk: Data.lsf, IMC.xml.gz, Config.ini and Output.txt in one folder.

    The folder is `root`/`name`, with _2, _3 ... appended if it exists already. Raises OSError, and then leaves nothing
    behind.
    """

    def __init__(self, root: Path, name: str, compression: str, schema: bytes, configuration: bytes):
        self.path = _new_folder(root / name)
        self.physical_name = f"{self.path.parent.name}/{self.path.name}"
        suffix = COMPRESSIONS[compression].suffix if compression != "none" else ""
        try:
            (self.path / "IMC.xml.gz").write_bytes(schema)
            (self.path / "Config.ini").write_bytes(configuration)
            self.text = LsfWriter(self.path / "Output.txt", "none")
            self.data = LsfWriter(self.path / f"Data.lsf{suffix}", compression)
        except OSError:
            shutil.rmtree(self.path, ignore_errors=True)
            raise

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not accepted yet."""
        return self.data.waiting + self.text.waiting

    def flush(self) -> None:
        """Hand everything to the operating system. Raises OSError; FileNotFoundError if the folder was removed."""
        if not self.data.in_place():
            raise FileNotFoundError(errno.ENOENT, "the log was removed", str(self.path))
        self.data.flush()
        self.text.flush()

    def close(self) -> None:
        """Flush and close both files; they are closed even if it raises OSError."""
        try:
            self.data.close()
        finally:
            self.text.close()


def definitions() -> bytes:
    """IMC.xml.gz with all messages of this version."""
    return gzip_member(imc.dump(imc.builtin()), level=9)


def _new_folder(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    number, name = 1, path.name
    while True:
        try:
            path.mkdir()
            return path
        except FileExistsError:
            number += 1
            path = path.with_name(f"{name}_{number}")
