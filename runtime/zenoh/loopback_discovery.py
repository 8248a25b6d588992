"""Announces the endpoint of a session to the other zenoh programs of this computer, without a socket open to others.

zenoh's own scouting listens at 0.0.0.0 for any choice of interface, and connects to each program that answers. This one
has one socket, bound to the loopback address, makes no connection, and answers only programs of this computer: it sends
a SCOUT to zenoh's multicast group on the loopback interface; a program that receives it answers with a HELLO, and gets
a HELLO with the address of the session, to which it then connects. Format: zenoh-protocol 1.x, scouting.
"""

import contextlib
import logging
import socket
import threading
import time
from collections.abc import Iterable, Mapping

LOOPBACK = "127.0.0.1"
PERIOD = 1.0  # s
MOST_ANSWERS = 256  # read in one period
LARGEST = 65535

VERSION = 9
SCOUT, HELLO = 0x01, 0x02
LOCATORS = 0x20  # flag of a HELLO: a list of locators follows
ROUTERS_AND_PEERS = 0b011
ROLES: Mapping[str, int] = {"router": 0, "peer": 1, "client": 2}

logger: logging.Logger = logging.getLogger("shoal.zenoh")


def scout_message() -> bytes:
    """Asks routers and peers who they are."""
    return bytes((SCOUT, VERSION, ROUTERS_AND_PEERS))


def hello_message(zid: str, role: str, locators: Iterable[str]) -> bytes:
    """Names a session, `zid` as zenoh prints it, and its locators. A locator has at most 127 characters."""
    number = bytes.fromhex(zid.zfill(len(zid) + len(zid) % 2))[::-1]
    texts = [locator.encode() for locator in locators]
    listed = b"".join(bytes((len(text),)) + text for text in texts)
    head = bytes((HELLO | LOCATORS, VERSION, (len(number) - 1) << 4 | ROLES[role]))
    return head + number + bytes((len(texts),)) + listed


def is_hello(datagram: bytes) -> bool:
    return len(datagram) > 3 and datagram[0] & 0x1F == HELLO


class HelloSender:
    """Invites the zenoh programs of this computer, once per PERIOD, until `close`."""

    def __init__(self, group: str, invitation: bytes) -> None:
        host, _, port = group.rpartition(":")
        self._group = host, int(port)
        self._invitation = invitation
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="zenoh scout", daemon=True)
        self._socket: socket.socket | None = None

    def open(self) -> None:
        """Begin. Without multicast on this computer there is no discovery; the local port can still be used."""
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        here = socket.inet_aton(LOOPBACK)
        try:
            made.bind((LOOPBACK, 0))
            made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, here)
            # Nothing arrives here for the group; but only as a member does the interface pass it on to the others.
            made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(self._group[0]) + here)
        except OSError as error:
            made.close()
            logger.warning("cannot announce the vehicle to other programs of this computer: %s", error)
            return
        self._socket = made
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(b"", self._socket.getsockname())  # ends the wait
            self._thread.join()
            self._socket.close()

    def _run(self) -> None:
        assert self._socket is not None
        while not self._closing.is_set():
            until = time.monotonic() + PERIOD
            self._send(scout_message(), self._group)
            for _ in range(MOST_ANSWERS):
                if self._closing.is_set() or (left := until - time.monotonic()) <= 0.0:
                    break
                self._socket.settimeout(left)
                try:
                    datagram, place = self._socket.recvfrom(LARGEST)
                except OSError:  # no answer, or an earlier datagram was refused
                    continue
                if is_hello(datagram):
                    self._send(self._invitation, place)
            self._closing.wait(until - time.monotonic())

    def _send(self, datagram: bytes, place: tuple[str, int]) -> None:
        assert self._socket is not None
        with contextlib.suppress(OSError):  # it has left, or the interface is down
            self._socket.sendto(datagram, place)
