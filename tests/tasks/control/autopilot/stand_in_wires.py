"""The links of the stand-in: UDP that speaks first or waits, a TCP server, a serial device; with losses."""

import contextlib
import os
import random
import socket
import tty


class Wire:
    """Where pymavlink writes, and what it reads; `loss` is the part of the portions that never arrive."""

    def __init__(self, options):
        self.loss, self.random = options.loss, random.Random(options.seed)
        self.peer = self.file = self.listener = None
        if options.serial:
            self.file = options.serial  # the other end of a pseudo terminal
            tty.setraw(self.file)
            os.set_blocking(self.file, False)
        elif options.tcp:
            self.listener = socket.create_server(("127.0.0.1", options.port))
            self.listener.setblocking(False)
        else:
            self.peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.peer.setblocking(False)
            if options.waits:
                self.peer.bind(("127.0.0.1", options.port))
            else:
                self.peer.connect(("127.0.0.1", options.port))
        self.waits = options.waits

    def lost(self):
        return self.random.random() < self.loss

    def write(self, data):
        if self.lost():
            return
        with contextlib.suppress(OSError):
            if self.file is not None:
                os.write(self.file, data)
            elif self.peer is not None and not self.waits:
                self.peer.send(data)

    def read(self):
        try:
            if self.file is not None:
                return os.read(self.file, 4096)
            if self.listener is not None:
                with contextlib.suppress(BlockingIOError):
                    self.peer = self.listener.accept()[0]
                    self.peer.setblocking(False)
            if self.peer is None:
                return b""
            if self.waits:
                data, sender = self.peer.recvfrom(4096)
                self.peer.connect(sender)
                self.waits = False
            else:
                data = self.peer.recv(4096)
        except OSError:
            return b""
        return b"" if self.lost() else data

    def close(self):
        for opened in (self.peer, self.listener):
            if opened is not None:
                opened.close()
