"""Packets in pieces, for links that carry little at a time: MessagePart.

A piece has 27 bytes besides its data: header, number, count, length and CRC. DUNE leaves room for all of them within
its limit, imcjava forgets the CRC; who puts the pieces together need not care. Source: DUNE, Network/Fragments;
imcjava, net/IMCFragmentHandler.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from fastcrc.crc16 import arc

from imc.codec import byte_order, datagram_packet, with_header
from imc.codec_compiler import LARGEST_PACKET
from imc.errors import DecodeError, EncodeError
from imc.layout import FOOTER_SIZE, SMALLEST_PACKET
from imc.messages import MessagePart

OVERHEAD = SMALLEST_PACKET + 5  # bytes of a piece besides its data
MOST_PARTS = 255
UIDS = 255  # a sender numbers its messages 0 to 254

MOST = 64  # messages that are incomplete
MOST_NAMED = 64  # systems and reasons
MOST_OF_ONE = 8  # of one system
MOST_BYTES = 1 << 20


def split_packet(packet: bytes, limit: int, uid: int) -> list[MessagePart]:
    """The pieces of a packet, each a packet of at most `limit` bytes; `uid` numbers the messages of a sender.

    Raises EncodeError if there is no room for data in so little, or the packet takes more than 255 pieces.
    """
    size = limit - OVERHEAD
    count = -(-len(packet) // size) if size > 0 else MOST_PARTS + 1
    if count > MOST_PARTS:
        raise EncodeError(f"{len(packet)} bytes do not fit into {MOST_PARTS} pieces of {limit} bytes")
    pieces = (packet[start : start + size] for start in range(0, len(packet), size))
    return [
        MessagePart(uid=uid % UIDS, frag_number=number, num_frags=count, data=piece)
        for number, piece in enumerate(pieces)
    ]


@dataclass(slots=True)
class IncompleteMessage:
    """A message of which pieces are missing: how many it has, and those that have arrived, since when (s)."""

    count: int
    since: float
    destination: int
    parts: dict[int, bytes] = field(default_factory=dict[int, bytes])
    size: int = 0
    asked: bool = False

    def format_missing_parts(self) -> str:
        """The text of MessagePartControl that asks for the missing pieces: their numbers, or ! and the others."""
        missing = _listed(number for number in range(self.count) if number not in self.parts)
        present = "!" + _listed(sorted(self.parts))
        return min(missing, present, key=len)


class FragmentAssembler:
    """Puts pieces together, by system and uid. What is never complete is forgotten, and so is what is too much.

    Counted: `counts`, by what became of messages and pieces; `given_up` is who lost messages, and why.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.given_up: dict[tuple[int, str], None] = {}
        self._waiting: dict[tuple[int, int], IncompleteMessage] = {}
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, part: MessagePart, now: float) -> bytes | None:
        """Take a piece; the packet if it is complete now, with the source and destination of its pieces.

        Raises DecodeError if the piece cannot be one, or the pieces are no packet.
        """
        if not part.data or part.frag_number >= part.num_frags:
            self.counts["malformed"] += 1
            raise DecodeError(f"piece {part.frag_number} of {part.num_frags} with {len(part.data)} bytes")
        key = part.src, part.uid
        found = self._waiting.get(key)
        if found is not None and not _continues(found, part):  # the sender has begun another message
            self._forget(key, "given up by the sender")
            found = None
        if found is None:
            self._make_room(part.src)
            found = self._waiting[key] = IncompleteMessage(part.num_frags, now, part.dst)
        if part.frag_number not in found.parts:
            found.parts[part.frag_number] = part.data
            found.size += len(part.data)
            self._bytes += len(part.data)
        if found.size > LARGEST_PACKET:
            self._forget(key, "malformed")
            raise DecodeError("the pieces are larger than a packet can be")
        while self._bytes > MOST_BYTES:
            self._forget(next(iter(self._waiting)), "crowded out")
        if key not in self._waiting or len(found.parts) < found.count:
            return None
        self._forget(key, "")
        packet = b"".join(found.parts[number] for number in range(found.count))
        try:
            whole = _checked(packet)
        except DecodeError:
            self.counts["malformed"] += 1
            raise
        self.counts["complete"] += 1
        return with_header(whole, src=part.src, dst=part.dst)

    def overdue_messages(self, before: float) -> list[tuple[int, int, IncompleteMessage]]:
        """System, uid and message of those that began before a time (s), and were not asked for."""
        return [(*key, each) for key, each in self._waiting.items() if each.since < before and not each.asked]

    def expire(self, before: float) -> None:
        """Forget what began before a time (s)."""
        for key in [key for key, each in self._waiting.items() if each.since < before]:
            self._forget(key, "never completed")

    def _make_room(self, source: int) -> None:
        own = [key for key in self._waiting if key[0] == source]
        if len(own) >= MOST_OF_ONE:
            self._forget(own[0], "crowded out")
        elif len(self._waiting) >= MOST:
            self._forget(next(iter(self._waiting)), "crowded out")

    def _forget(self, key: tuple[int, int], why: str) -> None:
        self._bytes -= self._waiting.pop(key).size
        if not why:
            return
        self.counts[why] += 1
        if len(self.given_up) < MOST_NAMED:
            self.given_up[key[0], why] = None


def _continues(found: IncompleteMessage, part: MessagePart) -> bool:
    """Whether a piece belongs to a message; its uid may come again with another."""
    same = found.parts.get(part.frag_number, part.data) == part.data
    return same and (part.num_frags, part.dst) == (found.count, found.destination)


def _checked(data: bytes) -> bytes:
    """The packet that pieces make up. Raises DecodeError."""
    packet = datagram_packet(data)
    if arc(packet[:-FOOTER_SIZE]) != int.from_bytes(packet[-FOOTER_SIZE:], byte_order(packet)):
        raise DecodeError("wrong CRC")
    return packet


def _listed(numbers: Iterable[int]) -> str:
    return ",".join(map(str, numbers))
