"""The index that imcjava and Neptus keep of a log: mra/lsf.index beside it."""

import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imc.lsf.log import Log
from support.atomic_files import replace_file

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAGIC = b"IDX1"
PLACE = Path("mra") / "lsf.index"
_ENTRY = [("time", ">i4"), ("id", ">u2"), ("offset", ">i8")]
_HEAD = struct.Struct(">4sd")


def write_neptus_index(log: Log, path: Path | None = None) -> Path:
    """Write the index of a log where Neptus looks for it, or to `path`, and return its path.

    Offsets are those in the unpacked log, because Neptus unpacks a log before it reads it. Raises OSError.
    """
    import numpy as np

    path = path or log.path.parent / PLACE
    path.parent.mkdir(parents=True, exist_ok=True)
    origin: float | None = None
    with replace_file(path, durable=False) as file:
        for batch in log.batches():
            if not batch.starts.size:
                continue
            times = batch.times()
            if origin is None:
                origin = float(times[0])
                file.write(_HEAD.pack(MAGIC, origin))
            entries = np.empty(times.size, _ENTRY)
            elapsed = np.nan_to_num((times - origin) * 1000.0, posinf=np.inf, neginf=-np.inf)
            entries["time"] = np.clip(elapsed, -(2**31), 2**31 - 1)
            entries["id"] = batch.heads & 0xFFFF
            entries["offset"] = batch.starts + batch.base
            file.write(entries.tobytes())
        if origin is None:
            file.write(_HEAD.pack(MAGIC, 0.0))
    return path


def read_neptus_index(path: Path) -> tuple[float, "NDArray[Any]"]:
    """The time of the first message (s since 1970 UTC), and for each message: time (ms since then), id, offset.

    Neptus checks neither CRCs nor whether the log has changed since; compare with `Log` before you rely on it.
    Raises ValueError if it is not such an index, OSError.
    """
    import numpy as np

    data = path.read_bytes()
    if not data.startswith(MAGIC) or (len(data) - _HEAD.size) % np.dtype(_ENTRY).itemsize:
        raise ValueError(f"{path}: not a Neptus index")
    return _HEAD.unpack_from(data)[1], np.frombuffer(data, _ENTRY, offset=_HEAD.size)
