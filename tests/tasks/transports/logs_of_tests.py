"""Tasks that make logs, and readers of them."""

import gzip
from pathlib import Path
from typing import Any

import imcpy

import imc
from imc.lsf import Log
from runtime import Task, consume, periodic


class Whistle(Task):
    """Publishes ten times a second."""

    @periodic(10.0)
    def tick(self) -> None:
        self.publish(imc.Temperature(value=20.0 + self.random.random()))


class Listener(Task):
    """Receives and publishes nothing."""

    @consume
    def hear(self, message: imc.Temperature) -> None:
        self.random.random()


def logs(root: Path) -> list[Path]:
    return sorted(root.glob("lauv-noptilus-1/*/*"))


def only_log(root: Path) -> Log:
    (folder,) = logs(root)
    return Log(folder)


def unpacked(log: Log) -> bytes:
    data = log.path.read_bytes()
    return gzip.decompress(data) if log.path.suffix == ".gz" else data


def read_by_imcpy(data: bytes) -> list[Any]:
    found: list[Any] = []
    while data:
        size = int.from_bytes(data[4:6], "little") + 22
        found.append(imcpy.Packet.deserialize(data[:size]))
        data = data[size:]
    return found
