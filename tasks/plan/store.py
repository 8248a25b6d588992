"""The table of plans: SQLite, in a file or in memory."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from hashlib import md5
from pathlib import Path
from typing import NamedTuple

import imc
from imc.layout import FOOTER_SIZE, HEADER_SIZE
from imc.reserved_ids import UNKNOWN_SYSTEM
from support.atomic_files import make_folder
from support.file_errors import describe_os_error

MOST_PLANS = 1000
MOST_BYTES = 32 << 20  # of all plans

Row = tuple[str | bytes | float | None, ...]
_SCHEMA = """
CREATE TABLE IF NOT EXISTS Plan (
    plan_id TEXT PRIMARY KEY, change_time REAL, change_sid INTEGER, change_sname TEXT, md5 BLOB, data BLOB);
CREATE TABLE IF NOT EXISTS LastChange (change_time REAL, change_sid INTEGER, change_sname TEXT);
"""
_UNREADABLE = """
SELECT COUNT(*) FROM Plan WHERE typeof(plan_id) NOT IN ('text', 'blob') OR typeof(md5) != 'blob'
    OR typeof(data) != 'blob' OR typeof(change_time) != 'real' OR typeof(change_sid) != 'integer'
    OR typeof(change_sname) != 'text'
"""


WAIT = 0.2  # s for another program that writes; the vehicle does nothing else meanwhile
_REMEDIES = {
    "SQLITE_BUSY": "end the other program that uses it",
    "SQLITE_LOCKED": "end the other program that uses it",
    "SQLITE_FULL": "make room on its disk",
    "SQLITE_IOERR": "make room on its disk, and check the disk",
    "SQLITE_READONLY": "let the vehicle's user write the file and its folder",
    "SQLITE_PERM": "let the vehicle's user write the file and its folder",
    "SQLITE_CANTOPEN": "let the vehicle's user write the file and its folder",
    "SQLITE_CORRUPT": "start the vehicle again, which keeps the readable plans",
    "SQLITE_NOTADB": "start the vehicle again, which keeps the readable plans",
    "SQLITE_ERROR": "rename it: its tables are not those of a plan database",
}


def describe_database_error(error: sqlite3.Error | OSError, path: Path | None) -> str:
    """The file, by default memory, what is wrong with it, and the remedy, if there is one."""
    if isinstance(error, OSError):
        return describe_os_error(error, path or "")
    # Extended names, as SQLITE_IOERR_WRITE, begin with that of their kind; errors of the module itself have none.
    kind = "_".join(getattr(error, "sqlite_errorname", "").split("_")[:2])
    parts = (str(path or ""), str(error), _REMEDIES.get(kind, "") if path else "")
    return ": ".join(part for part in parts if part)


class StoreFullError(ValueError):
    """Raised when there is no room for one more plan."""


class PlanChange(NamedTuple):
    """The system that changed something, and the time (s since 1970 UTC)."""

    time: float = -1.0
    system: int = UNKNOWN_SYSTEM
    name: str = ""


class PlanRow(NamedTuple):
    """A plan: `data` are the serialized fields of its PlanSpecification, `md5` is their digest."""

    plan_id: str
    change: PlanChange
    md5: bytes
    data: bytes

    def information(self) -> imc.PlanDBInformation:
        return imc.PlanDBInformation(
            plan_id=self.plan_id,
            plan_size=len(self.data),
            change_time=self.change.time,
            change_sid=self.change.system,
            change_sname=self.change.name,
            md5=self.md5,
        )

    def specification(self) -> imc.PlanSpecification:
        """Raises imc.DecodeError if the stored data are damaged."""
        empty = imc.encode(imc.PlanSpecification())
        size = len(self.data).to_bytes(2, "little")
        # The fields under a header with their size; with_header adds the CRC.
        draft = empty[:4] + size + empty[6:HEADER_SIZE] + self.data + bytes(FOOTER_SIZE)
        found = imc.decode(imc.with_header(draft))
        if not isinstance(found, imc.PlanSpecification):
            raise imc.DecodeError("not a PlanSpecification")
        return found


def serialize_fields(plan: imc.PlanSpecification) -> bytes:
    """The serialized fields, little-endian, from which the digest of a plan is made."""
    return imc.encode(plan)[HEADER_SIZE:-FOOTER_SIZE]


class PlanStore:
    """Plans by id. `path` None keeps them in memory; `wait` (s) is the time for another program that writes.

    Raises OSError; sqlite3.Error if the file is no plan database, damaged, or cannot be written.
    """

    def __init__(self, path: Path | None, wait: float = WAIT):
        if path is not None:
            make_folder(path.parent)
        self._base = sqlite3.connect(path or ":memory:", check_same_thread=False, timeout=wait)
        try:
            self._base.executescript(f"BEGIN; {_SCHEMA}")
            self._check(path)
            self._base.commit()
        except sqlite3.Error:
            self._base.close()
            raise

    def _check(self, path: Path | None) -> None:
        self._base.execute("SELECT plan_id, change_time, change_sid, change_sname, md5, data FROM Plan LIMIT 1")
        if path is None:
            return
        (found,) = self._base.execute("PRAGMA quick_check(1)").fetchone()
        if found != "ok":
            raise sqlite3.DatabaseError(found.splitlines()[-1])
        self._base.execute("SELECT plan_id, change_sname FROM Plan").fetchall()  # text that is not UTF-8 is an error
        self._base.execute("SELECT change_sname FROM LastChange").fetchall()
        (unreadable,) = self._base.execute(_UNREADABLE).fetchone()
        if unreadable:
            raise sqlite3.DatabaseError(f"{unreadable} plans have fields of other types")
        self._base.execute("DELETE FROM Plan WHERE 0")  # an error if it cannot be written

    def copy_readable(self, path: Path) -> int:
        """Copy the plans of a damaged file that can be read, into this empty store; returns how many."""
        with suppress(sqlite3.Error), closing(sqlite3.connect(":memory:")) as damaged:
            damaged.text_factory = _decoded
            damaged.deserialize(_padded(path.read_bytes()))
            for order in ("ASC", "DESC"):  # each reads the plans before the first damaged page
                with suppress(sqlite3.Error):
                    for plan_id, data in damaged.execute(f"SELECT plan_id, data FROM Plan ORDER BY rowid {order}"):
                        with suppress(sqlite3.Error, TypeError, ValueError, AttributeError, imc.DecodeError):
                            plan = PlanRow(_text(plan_id), PlanChange(), b"", data).specification()
                            if plan.plan_id == _text(plan_id):
                                self.set(plan, PlanChange())
        (count,) = self._base.execute("SELECT COUNT(*) FROM Plan").fetchone()
        return count

    def close(self) -> None:
        self._base.close()

    def get(self, plan_id: str) -> PlanRow | None:
        return next(self._select("WHERE plan_id = ?", plan_id), None)

    def all(self) -> list[PlanRow]:
        """All plans by id."""
        return list(self._select("ORDER BY plan_id"))

    def set(self, plan: imc.PlanSpecification, change: PlanChange) -> tuple[PlanRow, bool]:
        """Store a plan; returns it as stored, and True if its id is new. Raises StoreFullError."""
        data = serialize_fields(plan)
        stored = PlanRow(plan.plan_id, change, md5(data, usedforsecurity=False).digest(), data)
        query = "SELECT LENGTH(data) FROM Plan WHERE plan_id = ?"
        replaced = self._base.execute(query, (_key(plan.plan_id),)).fetchone()
        new = replaced is None
        count, size = self._base.execute("SELECT COUNT(*), COALESCE(SUM(LENGTH(data)), 0) FROM Plan").fetchone()
        if new and count >= MOST_PLANS:
            raise StoreFullError(f"{count} plans are stored, which is the limit: delete some")
        if size - (0 if new else replaced[0]) + len(data) > MOST_BYTES:
            raise StoreFullError(f"all plans together may have {MOST_BYTES >> 20} MiB: delete some")
        with self._base:
            self._base.execute(
                "INSERT OR REPLACE INTO Plan VALUES (?, ?, ?, ?, ?, ?)", (_key(plan.plan_id), *change, *stored[2:])
            )
            self._changed(change)
        return stored, new

    def delete(self, plan_id: str, change: PlanChange) -> bool:
        """Delete a plan; True if it existed."""
        with self._base:
            gone = self._base.execute("DELETE FROM Plan WHERE plan_id = ?", (_key(plan_id),)).rowcount > 0
            if gone:
                self._changed(change)
        return gone

    def clear(self, change: PlanChange) -> None:
        with self._base:
            self._base.execute("DELETE FROM Plan")
            self._changed(change)

    def state(self) -> imc.PlanDBState:
        """The last change, all plans and the digest of their digests in the order of their ids."""
        # The data, megabytes of them, are not read.
        query = "SELECT plan_id, change_time, change_sid, change_sname, md5, LENGTH(data) FROM Plan ORDER BY plan_id"
        plans = [
            imc.PlanDBInformation(
                plan_id=_text(key),
                plan_size=size,
                change_time=time,
                change_sid=system,
                change_sname=name,
                md5=bytes(digest),
            )
            for key, time, system, name, digest, size in self._base.execute(query)
        ]
        row = self._base.execute("SELECT change_time, change_sid, change_sname FROM LastChange").fetchone()
        last = PlanChange(*row) if row else PlanChange()
        digest = md5(b"".join(plan.md5 for plan in plans), usedforsecurity=False).digest()
        return imc.PlanDBState(
            plan_count=len(plans),
            plan_size=sum(plan.plan_size for plan in plans),  # integers
            change_time=last.time,
            change_sid=last.system,
            change_sname=last.name,
            md5=digest,
            plans_info=tuple(plans),
        )

    def rows(self) -> tuple[list[Row], list[Row]]:
        """The rows of both tables, plans and the last change."""
        plans = self._base.execute("SELECT * FROM Plan ORDER BY plan_id").fetchall()
        return plans, self._base.execute("SELECT * FROM LastChange").fetchall()

    def add_rows(self, plans: list[Row], changes: list[Row]) -> None:
        """Copy the rows of another store, all or none, over those with the same ids. Raises sqlite3.Error."""
        with self._base:
            self._base.executemany("INSERT OR REPLACE INTO Plan VALUES (?, ?, ?, ?, ?, ?)", plans)
            if changes:
                self._base.execute("DELETE FROM LastChange")
                self._base.executemany("INSERT INTO LastChange VALUES (?, ?, ?)", changes)

    def _select(self, clause: str, *plan_id: str) -> Iterator[PlanRow]:
        query = f"SELECT plan_id, change_time, change_sid, change_sname, md5, data FROM Plan {clause}"
        for key, time, system, name, digest, data in self._base.execute(query, tuple(map(_key, plan_id))):
            yield PlanRow(_text(key), PlanChange(time, system, name), bytes(digest), bytes(data))

    def _changed(self, change: PlanChange) -> None:
        self._base.execute("DELETE FROM LastChange")
        self._base.execute("INSERT INTO LastChange VALUES (?, ?, ?)", change)


def _decoded(raw: bytes) -> str:
    return raw.decode(errors="surrogateescape")


def _padded(file: bytes) -> bytes:
    """A file of SQLite with as many pages as in its header, which SQLite requires before it reads any."""
    page, count = int.from_bytes(file[16:18]), int.from_bytes(file[28:32])
    return file.ljust(min(page * count, 2 * MOST_BYTES), b"\0")


def _key(plan_id: str) -> str | bytes:
    """The id as text, or as bytes if it is not UTF-8."""
    raw = plan_id.encode(errors="surrogateescape")
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw


def _text(key: str | bytes) -> str:
    return key.decode(errors="surrogateescape") if isinstance(key, bytes) else key
