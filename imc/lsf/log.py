"""LSF logs: files of consecutive packets, plain or compressed."""

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Unpack

from fastcrc.crc16 import arc

from imc.errors import DecodeError
from imc.lsf.byte_reader import ReportProgress, open_reader, unpacked_chunks
from imc.lsf.columns import ColumnReader, read_tables, without_short_packets
from imc.lsf.damage_list import DamageList
from imc.lsf.dataframe import to_dataframe
from imc.lsf.index import LogIndex, PacketPositions
from imc.lsf.log_files import find_log, find_schema
from imc.lsf.message_kind import Kind, kind_name, message_type
from imc.lsf.packet_reader import PacketReader, StaleIndex
from imc.lsf.parallel_gunzip import ParallelMap
from imc.lsf.position_columns import positions
from imc.lsf.scanner import Batch, scan
from imc.lsf.selection import Conditions, HeaderFilter, MessageSequence, entity_labels, keys_with_name, select
from imc.lsf.writer import BLOCK, LsfWriter
from imc.message import Message
from imc.schema import Schema
from imc.stream import Loss

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

WORTH_KEEPING = 1 << 22  # bytes of a log from which on its index is written to disk
SORTED_TOGETHER = 1 << 15  # packets in memory while messages are read in order of time

T = TypeVar("T")

__all__ = ["BLOCK", "Log", "LsfWriter"]


class Log:
    """A log on disk: a folder that holds Data.lsf (or .lsf.gz, .lsf.bz2, .lsf.z), or such a file.

    `schema` is read from the IMC.xml or IMC.xml.gz beside the data, and `schema_source` is its path. Without one,
    `schema` is the built-in schema and `schema_source` is None. Messages with the same definition in both are of the
    classes in `imc`.

    `packets` and `messages` read the whole log in the order of the file, which is not always that of the times;
    `time_ordered` sorts by time. `log["EstimatedState"]` and `array` return columns, `objects` the same messages one
    by one. Types are given as classes or names; KeyError if the schema has no such name. Conditions: `start` <=
    timestamp < `end` (s since 1970 UTC), `src` is a system's id or the name it announces, `entity` is an entity's id
    or its label; KeyError if the log has no such name.

    The first access to a type reads the log once and makes an index. For logs of 4 MiB or more it is kept in the
    user's cache; with keep_index="beside" beside the log, with keep_index=False nowhere. An index is used while size,
    time of change, start and end of the log are the same, and each packet read by it is checked: if one is not there,
    the log is indexed again. Memory does not grow with the log, except for the index (2 to 8 bytes per packet) and
    the result.

    Damage is skipped, and listed in `losses` once it has been read; every packet around it is found. A packet is
    accepted if its CRC is right, with crc=False also if another packet follows it immediately. Raises
    FileNotFoundError if there is no log, SchemaError for a bad IMC.xml.

    With spread=executor.map of a ThreadPoolExecutor, its threads unpack the members of a .gz, some MiB ahead.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        schema: Schema | None = None,
        *,
        crc: bool = True,
        keep_index: bool | Literal["beside"] = True,
        spread: ParallelMap | None = None,
    ):
        self.path: Path = find_log(Path(path))
        self.schema: Schema
        self.schema_source: Path | None
        self.schema, self.schema_source = (schema, None) if schema else find_schema(self.path)
        self._crc = crc
        self._keep_index = keep_index
        self.spread = spread
        self._lose = DamageList()
        self._indexed: tuple[tuple[int, ...], LogIndex] | None = None
        self._whole: dict[int, NDArray[np.bool_]] = {}
        self._names: dict[str, dict[Any, str]] = {}

    def __repr__(self) -> str:
        return f"Log({str(self.path)!r})"

    def __iter__(self) -> Iterator[Message]:
        return self.messages()

    def __len__(self) -> int:
        """The number of packets."""
        return sum(self.index().counts().values())

    def __getitem__(self, kind: Kind) -> "NDArray[Any]":
        """All messages of a type, like `array`."""
        return self.array(kind)

    @property
    def losses(self) -> list[Loss]:
        """The damage found so far, by offset in the unpacked log."""
        return self._lose.sorted()

    def counts(self) -> dict[str, int]:
        """Number of packets of each message, by name ("id 1234" if it is not in the schema)."""
        known = self.schema.types_by_id
        found = self.index().counts().items()
        return {known[number].abbrev if number in known else f"id {number}": count for number, count in found}

    def batches(self) -> Iterator[Batch]:
        """The packets in the order of the file, many at a time, as arrays of their places and headers."""
        return scan(unpacked_chunks(self.path, self._lose, spread=self.spread), self.schema.sync, self._lose, self._crc)

    def packets(self) -> Iterator[tuple[int, bytes]]:
        """Offset in the unpacked stream, and bytes, of each packet."""
        for batch in self.batches():
            yield from batch.packets()

    def messages(self, *kinds: Kind, **where: Unpack[Conditions]) -> Iterator[Message]:
        """The decoded messages of the given types, or of all, in the order of the file.

        A packet that is too short for the fields of its message is a loss.
        """
        return self._decoded(self._ids(kinds), self._meaning(where))

    def time_ordered(self, *kinds: Kind, **where: Unpack[Conditions]) -> Iterator[Message]:
        """The same as `messages`, by timestamp: equal times in the order of the file, those with NaN last."""
        import numpy as np

        conditions = self._meaning(where)

        def find() -> "tuple[PacketPositions, NDArray[Any]]":
            with self._reader() as reader:
                places = select(self.index().packet_positions(self._ids(kinds)), conditions, reader)
                times = [np.empty(0), *(batch.times() for batch in reader.batches(places))]
                return places, np.argsort(np.concatenate(times), kind="stable")

        places, order = self._with_true_index(find)
        with self._reader() as reader:
            for begin in range(0, order.size, SORTED_TOGETHER):
                part = order[begin : begin + SORTED_TOGETHER]
                batches = reader.batches(places.select(np.sort(part)))
                packets = [item for batch in batches for item in batch.packets()]
                ranks: list[int] = np.argsort(np.argsort(part)).tolist()
                yield from self._decode_all(packets[rank] for rank in ranks)

    def array(self, kind: Kind, **where: Unpack[Conditions]) -> "NDArray[Any]":
        """The messages of a type as a structured array of shape (n,), in the order of the file.

        Its fields are timestamp (s since 1970 UTC), src, src_ent, dst, dst_ent and all fields of the message that are
        numbers, in the units of the schema. Texts, raw data and messages inside are in `objects`, row by row.
        """
        rows = self._rows(kind)
        conditions = self._meaning(where)
        return rows if conditions.matches_all else rows[conditions.row_mask(rows)]

    def arrays(self, *kinds: Kind) -> "dict[str, NDArray[Any]]":
        """The `array` of each of the types, or of all in the log, by name; the log is read once."""
        known = self.schema.types_by_id

        def read() -> list[ColumnReader]:
            names = [kind_name(kind) for kind in kinds] or [
                known[n].abbrev for n in self.index().counts() if n in known
            ]
            tables = [self._table(name) for name in names]
            with self._reader() as reader:
                read_tables(tables, reader)
            return tables

        tables = self._with_true_index(read)
        self._whole |= {table.kind.id: table.whole for table in tables}
        return {table.kind.abbrev: table.complete_rows() for table in tables}

    def objects(self, kind: Kind, **where: Unpack[Conditions]) -> MessageSequence:
        """The messages of a type as a sequence that decodes on access; number i is row i of `array`."""
        self._ids((kind,))
        meaning = self._meaning(where)
        return MessageSequence(self.path, lambda: self._places(kind, meaning), self._reader, self._decode)

    def positions(self, kind: Kind = "EstimatedState", **where: Unpack[Conditions]) -> "NDArray[Any]":
        """The positions in the messages of a type, displaced by their offsets: see `imc.lsf.positions`."""
        return positions(self.array(kind, **where))

    def to_pandas(self, kind: Kind, **where: Unpack[Conditions]) -> Any:
        """The messages of a type as a pandas.DataFrame, all fields in the order of the schema, by time (UTC).

        Raises ImportError if pandas is not installed.
        """
        rows, conditions = self._rows(kind), self._meaning(where)
        frame = to_dataframe(message_type(self.schema, kind), rows, self.objects(kind))
        return frame if conditions.matches_all else frame[conditions.row_mask(rows)]

    @property
    def entities(self) -> dict[tuple[int, int], str]:
        """Labels of entities, by system and entity id, from EntityInfo and EntityList in the log."""
        self.index()
        if "entities" not in self._names:
            self._names["entities"] = dict(entity_labels(self.messages(*self._known("EntityInfo", "EntityList"))))
        return self._names["entities"]

    @property
    def systems(self) -> dict[int, str]:
        """Names of systems, by id, from Announce in the log."""
        self.index()
        if "systems" not in self._names:
            found = self.messages(*self._known("Announce"))
            self._names["systems"] = {m.src: str(getattr(m, "sys_name", "")) for m in found}
        return self._names["systems"]

    def index(self, progress: ReportProgress | None = None) -> LogIndex:
        """Index of the packets. Reads the log if there is no index of its present state.

        progress: called now and then with the share that has been read, 0 to 1.
        """
        return self._index(progress, loaded=True)

    def _index(self, progress: ReportProgress | None = None, *, loaded: bool) -> LogIndex:
        """The index; if it is not `loaded` from disk, the log is read."""
        from imc.lsf.index_file import open_index

        state = self.path.stat()
        now = (state.st_size, state.st_mtime_ns, state.st_ctime_ns)
        if self._indexed is None or self._indexed[0] != now or not loaded:
            self._whole.clear()
            self._names.clear()
            places = self._index_places() if now[0] >= WORTH_KEEPING else []
            found = open_index(self.path, self.schema.sync, self._crc, places, loaded, progress, self.spread)
            self._lose = DamageList(found.losses if self._indexed else [*self.losses, *found.losses])
            self._indexed = now, found
        return self._indexed[1]

    def _with_true_index(self, read: Callable[[], T]) -> T:
        """Result of `read`; if that finds the index wrong, the log is indexed again before a second try."""
        try:
            return read()
        except StaleIndex:
            self._index(loaded=False)
            return read()

    def _reader(self) -> PacketReader:
        reader = open_reader(self.path, self.index().members, self._lose, self.spread)
        return PacketReader(self.path, reader, self.schema.sync, self._crc)

    def _index_places(self) -> list[Path]:
        from imc.lsf.index_file import path_beside, path_in_cache

        if not self._keep_index:
            return []
        return [*([path_beside(self.path)] if self._keep_index == "beside" else []), *path_in_cache(self.path)]

    def _ids(self, kinds: Iterable[Kind]) -> frozenset[int]:
        return frozenset(message_type(self.schema, kind).id for kind in kinds)

    def _known(self, *names: str) -> list[str]:
        return [name for name in names if name in self.schema]

    def _batches(self, ids: frozenset[int]) -> Iterator[Batch]:
        """The packets with these ids, or all; by the index if there is one already."""
        import numpy as np

        if ids and self._index_at_hand():
            begin = 0
            try:
                for batch in self._indexed_batches(ids, begin):
                    yield batch
                    begin = batch.base + int(batch.ends[-1])
            except StaleIndex:
                self._index(loaded=False)
                yield from self._indexed_batches(ids, begin)
            return
        for batch in self.batches():
            yield batch.select(np.isin(batch.heads & 0xFFFF, list(ids))) if ids else batch

    def _indexed_batches(self, ids: frozenset[int], begin: int) -> Iterator[Batch]:
        places = self.index().packet_positions(ids)
        with self._reader() as reader:
            yield from reader.batches(places.select(places.offsets >= begin))

    def _index_at_hand(self) -> LogIndex | None:
        """The index, if it already exists."""
        from imc.lsf.index_file import has_index

        if self._indexed or has_index(self.path, self._index_places()):
            return self.index()
        return None

    def _decoded(self, ids: frozenset[int], where: HeaderFilter) -> Iterator[Message]:
        for batch in self._batches(ids):
            yield from self._decode_all(
                (batch if where.matches_all else batch.select(where.batch_mask(batch))).packets()
            )

    def _decode_all(self, packets: Iterable[tuple[int, bytes]]) -> Iterator[Message]:
        decode = self.schema.codec.decode if self._crc else self._decode
        for offset, packet in packets:
            try:
                yield decode(packet)
            except DecodeError as error:
                self._lose(offset, len(packet), error.reason)

    def _decode(self, packet: bytes) -> Message:
        """The message in a packet; with crc=False even if the CRC is wrong."""
        if not self._crc and packet[0] == self.schema.sync & 0xFF:
            packet = packet[:-2] + arc(packet[:-2]).to_bytes(2, "little")
        elif not self._crc:
            packet = packet[:-2] + arc(packet[:-2]).to_bytes(2, "big")
        return self.schema.decode(packet)

    def _table(self, kind: Kind) -> ColumnReader:
        found = message_type(self.schema, kind)
        places = without_short_packets(found, self.index().packet_positions((found.id,)), self._lose)
        return ColumnReader(found, places, self._decode, self._lose)

    def _rows(self, kind: Kind) -> "NDArray[Any]":
        def read() -> "NDArray[Any]":
            table = self._table(kind)
            with self._reader() as reader:
                rows = table.read(reader)
            self._whole[table.kind.id] = table.whole
            return rows

        return self._with_true_index(read)

    def _places(self, kind: Kind, where: HeaderFilter) -> PacketPositions:
        """The packets that are rows of `array`."""
        found = message_type(self.schema, kind)
        self.index()
        if found.id not in self._whole:
            self._rows(kind)  # also checks the index, so that the messages cannot become fewer
        places = without_short_packets(found, self.index().packet_positions((found.id,)), self._lose)
        with self._reader() as reader:
            return select(places.select(self._whole[found.id]), where, reader)

    def _meaning(self, where: Conditions) -> HeaderFilter:
        """The conditions, with names replaced by ids. Raises KeyError."""
        src, entity = where.get("src"), where.get("entity")
        sources, entities = None, None
        if src is not None:
            sources = frozenset((src,) if isinstance(src, int) else keys_with_name(self.systems, src))
        if entity is not None:
            entities = frozenset(
                ((None, entity),) if isinstance(entity, int) else keys_with_name(self.entities, entity)
            )
        return HeaderFilter(where.get("start"), where.get("end"), sources, entities)
