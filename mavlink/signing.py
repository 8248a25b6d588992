"""Signatures of MAVLink 2 frames: a secret key, and times that only grow."""

import hmac
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

from mavlink.frames import ReceivedMessage

EPOCH = 1420070400  # 2015-01-01 UTC, in s since 1970
TICK = 1e-5  # s
LATEST = (1 << 48) - 1
END = LATEST - round(86400 / TICK)  # the time of others is followed up to here, so that it never runs out
BEHIND = round(60.0 / TICK)  # how far behind ours the time of a new stream may be
KEY, DIGEST, TIME = 32, 6, 6  # bytes
MOST_STREAMS = 256
LONGEST_FILE = 4096  # bytes
OPEN = ("RADIO_STATUS", "RADIO")  # radios send these by themselves, and have no key
UNSIGNED, FORGED, REPLAYED = "unsigned", "forged", "replayed"


def parse_key(content: bytes) -> bytes:
    """The key in a file: 32 bytes, 64 hexadecimal digits, or a line with a passphrase, of which SHA-256 is the key.

    The last is what MAVProxy and Mission Planner do. Raises ValueError, which does not repeat the content.
    """
    try:
        words = content.decode().strip("\r\n")
    except ValueError:
        words = ""
    if not words.isprintable() or not words:
        if len(content) == KEY:
            return content
        raise ValueError(f"it holds neither {KEY} bytes, nor {2 * KEY} hexadecimal digits, nor a line of text")
    try:
        key = bytes.fromhex(words.strip())
    except ValueError:
        key = b""
    return key if len(key) == KEY else sha256(words.encode()).digest()


def read_key(path: Path) -> bytes:
    """The key in a file. Raises OSError, and ValueError if there is none in it."""
    if not path.is_file():
        path.stat()
        raise ValueError("it is no file")
    with path.open("rb") as file:
        return parse_key(file.read(LONGEST_FILE))


class SigningTime:
    """The time in signatures: 10 µs since 2015, never twice the same, and never behind what others have signed.

    `clock` gives s since 1970; one that was never set may be far behind. `latest` is the last time that was used.
    `known` is one up to which frames may have come before a restart: they are not new. `keep` is called with the time
    of each accepted frame before the frame has an effect.
    """

    def __init__(
        self,
        clock: Callable[[], float],
        latest: int = 0,
        known: int = 0,
        keep: Callable[[int], None] = lambda _: None,
    ):
        self._clock = clock
        self._keep = keep
        self.known = known
        self.latest: int = max(0, min(latest, END))

    @property
    def now(self) -> int:
        return max(self.latest, min(round((self._clock() - EPOCH) / TICK), END))

    def next(self) -> int:
        """A time for a frame of our own."""
        self.latest = min(max(self.latest + 1, self.now), LATEST)
        return self.latest

    def advance_to(self, time: int) -> None:
        """Do not stay behind a time that somebody with the key has signed."""
        if time > self.latest:
            self.latest = max(self.latest, min(time, END))
            self._keep(self.latest)


class Signing:
    """Signs frames with a key, and checks those of others.

    `time` is shared by all keys. No frame is accepted twice, on whichever link it comes.
    """

    def __init__(self, key: bytes, time: SigningTime):
        self._key = key
        self._time = time
        self._streams: dict[tuple[int, int, int], int] = {}  # link, system, component: the last time

    def signer(self, link: int) -> Callable[[bytes], bytes]:
        """Makes the signatures of frames on the link with a number."""
        prefix = bytes((link & 0xFF,))

        def sign(frame: bytes) -> bytes:
            stamp = prefix + self._time.next().to_bytes(TIME, "little")
            return stamp + self._digest(frame + stamp)

        return sign

    def reject_reason(self, message: ReceivedMessage) -> str:
        """Rejection of a message: UNSIGNED, FORGED or REPLAYED; empty if it is accepted. Its time is then noted."""
        signature = message.signature
        if not signature:
            return "" if message.name in OPEN else UNSIGNED
        stamp, digest = signature[:-DIGEST], signature[-DIGEST:]
        if not hmac.compare_digest(digest, self._digest(message.signed + stamp)):
            return FORGED  # before any time is noted: a forged one would lock the sender out
        time = int.from_bytes(stamp[1:], "little")
        stream = stamp[0], message.system, message.component
        oldest = max(self._time.now - BEHIND, self._time.known)
        if time <= self._streams.get(stream, oldest) or not self._has_room(stream, oldest):
            return REPLAYED
        self._streams[stream] = time
        self._time.advance_to(time)
        return ""

    def _has_room(self, stream: tuple[int, int, int], oldest: int) -> bool:
        """Whether the time of a stream can be kept, if need be in place of one that may not come back as it was."""
        if stream not in self._streams and len(self._streams) >= MOST_STREAMS:
            self._streams = {each: time for each, time in self._streams.items() if time > oldest}
        return stream in self._streams or len(self._streams) < MOST_STREAMS

    def _digest(self, content: bytes) -> bytes:
        return sha256(self._key + content).digest()[:DIGEST]
