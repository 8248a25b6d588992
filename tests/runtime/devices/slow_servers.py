"""Servers that accept, and then never say anything whole."""

import contextlib
import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator

Speech = Callable[[socket.socket], Iterator[None]]


def mute(_: socket.socket) -> Iterator[None]:
    while True:
        time.sleep(0.02)
        yield


def trickle(peer: socket.socket) -> Iterator[None]:
    """One byte at a time, of a line or a value that never ends."""
    for number in itertools.count():
        peer.sendall(b"\xc6\xff\xff\xff\xff"[number : number + 1] or b"1")
        time.sleep(0.02)
        yield


def endless(peer: socket.socket) -> Iterator[None]:
    """As fast as possible: msgpack that promises 4 GB, and no end of a line."""
    peer.sendall(b"\xc6\xff\xff\xff\xff")
    while True:
        peer.sendall(b"1" * 65536)
        yield


def rubbish(peer: socket.socket) -> Iterator[None]:
    while True:
        peer.sendall(b"\xc1\x00x\n" * 1024)
        yield


@contextlib.contextmanager
def served(speak: Speech) -> Iterator[int]:
    """The port of a server that speaks so to each client, one after the other."""
    listener, over = socket.create_server(("127.0.0.1", 0)), threading.Event()

    def serve() -> None:
        with contextlib.suppress(OSError):
            while not over.is_set():
                opened, _ = listener.accept()
                opened.settimeout(1.0)
                with opened, contextlib.suppress(OSError):
                    for _ in speak(opened):
                        if over.is_set():
                            break

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        over.set()
        with contextlib.suppress(OSError):
            listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(5.0)
