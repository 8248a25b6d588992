"""One discovery port for all vehicles of a computer: one of them listens, and forwards what it receives to the others.

There are five such ports, and consoles need some of them. Vehicles of one user that would listen at the same place meet
at an abstract Unix socket, which the system removes with the process that leads. Other systems have no such sockets.
"""

import errno
import os
import socket
import struct
from collections.abc import Callable

from runtime import Task
from tasks.transports.imc_links.sockets import schedule_network_timer

LONGEST = 65535
MOST_FOLLOWERS = 512
PAUSE = 0.1  # s, after a follower that could not be accepted
NOWHERE = "0.0.0.0"  # an empty packet from there is a sign of life of the leader
ROOT = 0
CREDENTIALS = struct.Struct("3i")  # process, user, group


class DiscoveryLeader:
    """Forwards what it receives; one that calls `pulse` once a second shows the followers that it is running.

    Raises FileExistsError if another one leads, OSError where it is not possible.
    """

    def __init__(self, task: Task, name: str):
        self._task = task
        self._followers: list[socket.socket] = []
        self._closed = False
        self._listener = _opened()
        try:
            self._listener.bind(_place(name))
            self._listener.listen(MOST_FOLLOWERS)
        except OSError as error:
            self._listener.close()
            if error.errno == errno.EADDRINUSE:
                raise FileExistsError(name) from None
            raise
        task.watch(self._listener, self._accept)

    def forward(self, address: str, packet: bytes) -> None:
        """Hand on a packet from an address; a follower that does not read misses it, one that is gone is forgotten."""
        words = socket.inet_aton(address) + packet
        for follower in list(self._followers):
            try:
                follower.send(words)
            except BlockingIOError:
                continue
            except OSError:
                self._followers.remove(follower)
                follower.close()

    def pulse(self) -> None:
        self.forward(NOWHERE, b"")

    def close(self) -> None:
        self._closed = True
        self._task.unwatch(self._listener)
        for each in (self._listener, *self._followers):
            each.close()

    def _accept(self) -> None:
        try:
            follower, _ = self._listener.accept()
        except BlockingIOError:
            return
        except OSError:  # it has gone already, or there are no file descriptors left
            self._task.unwatch(self._listener)
            schedule_network_timer(self._task, PAUSE, self._resume_accepting)
            return
        follower.setblocking(False)
        if len(self._followers) < MOST_FOLLOWERS:
            self._followers.append(follower)
            self.pulse()
        else:
            follower.close()

    def _resume_accepting(self) -> None:
        if not self._closed:
            self._task.watch(self._listener, self._accept)


class DiscoveryFollower:
    """Calls `take` with packets and their addresses, until the leader is gone: then `ended`, once.

    `welcome` is whether the leader has sent anything, `silence` how often `count_silence` was called since it did.
    Raises OSError without a leader, or with one of another user.
    """

    def __init__(self, task: Task, name: str, take: Callable[[bytes, str], object], ended: Callable[[], object]):
        self._task = task
        self._take, self._ended = take, ended
        self.welcome, self.silence = False, 0
        self._socket = _opened()
        try:
            self._socket.connect(_place(name))
            _, user, _ = CREDENTIALS.unpack(
                self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
            )
            if user not in (os.getuid(), ROOT):
                raise PermissionError(name)
        except OSError:
            self._socket.close()
            raise
        task.watch(self._socket, self._read)

    def count_silence(self) -> int:
        """Count one more period of silence; a vehicle that was stopped itself counts none for that."""
        self.silence += 1
        return self.silence

    def close(self) -> None:
        self._task.unwatch(self._socket)
        self._socket.close()

    def _read(self) -> None:
        try:
            words = self._socket.recv(LONGEST)
        except BlockingIOError:
            return
        except OSError:
            words = b""
        if words:
            self.welcome: bool = True
            self.silence: int = 0
            if words[4:]:
                self._take(words[4:], socket.inet_ntoa(words[:4]))
        else:
            self.close()
            self._ended()


def _opened() -> socket.socket:
    try:
        opened = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    except AttributeError:
        raise OSError("no Unix sockets") from None
    opened.setblocking(False)
    return opened


def _place(name: str) -> bytes:
    return f"\0shoal-{os.getuid()}-{name}".encode()[:107]
