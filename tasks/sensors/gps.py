"""GPS receivers: NMEA 0183, and UBX of u-blox."""

from importlib import import_module
from typing import Any

import imc
from runtime import State, Task, expect, param
from runtime.devices import FrameSplitter
from tasks.sensors.gnss_parser import (
    KINDS,
    LONGEST_UBX,
    UBX,
    FixAssembler,
    fix_from_ubx,
    has_valid_checksum,
    is_relevant_sentence,
)

UBX_FIRST = 5.0  # s after a UBX fix, in which NMEA fixes are left out: a receiver may send both
NAV_PVT, NAV_DOP = b"\x01\x07", b"\x01\x04"


class GPS(Task):
    """Publishes GpsFix, with a validity bit for each thing that the receiver says.

    The sentences of one moment (GGA or GNS, RMC, VTG, ZDA, GSA, GST, PUBX,00) become one fix. A receiver of u-blox may
    also send NAV-PVT, and NAV-DOP before it, instead of them. Damaged sentences are left out, and counted.
    """

    external = True
    requires = "drivers"

    port: str = param(
        "", "", "Serial port of the receiver, or tcp://HOST:PORT.", name="Serial Port - Device", editable=False
    )
    baud: int = param(
        9600, "Bd", "Baud rate of the port.", name="Serial Port - Baud Rate", minimum=1, maximum=4000000, editable=False
    )
    input_timeout: float = param(4.0, "s", "Time without a fix, valid or not, after which it is an error.", minimum=0.0)
    sentence_order: list[str] = param(
        [], "", "NMEA sentences of a fix, such as GPGGA, GPRMC; the last one ends it. Empty: learned.", editable=False
    )

    def start(self) -> None:
        self.epochs = FixAssembler(self.sentence_order[-1] if self.sentence_order else "")
        self.dilution: Any = None  # the last NAV-DOP
        self.ubx_at = -UBX_FIRST
        split = FrameSplitter(KINDS, valid=has_valid_checksum, longest=LONGEST_UBX)
        self.receiver = self.serial(self.port, self.baud, frames=self.receive_frame, split=split)

    def receive_frame(self, frame: bytes) -> None:
        if frame.startswith(UBX):
            self.receive_ubx(frame)
        elif is_relevant_sentence(frame) and self.age(self.ubx_at) >= UBX_FIRST:
            for fix in self.epochs.add(parse_sentence(frame), self.now):
                self.report(fix)

    def receive_ubx(self, frame: bytes) -> None:
        kind = frame[2:4]
        if kind == NAV_DOP:
            self.dilution = parse_ubx(frame)
        elif kind == NAV_PVT:
            self.ubx_at = self.now
            self.report(fix_from_ubx(parse_ubx(frame), self.dilution).replace(timestamp=self.now))

    @expect(every="input_timeout")
    def report(self, fix: imc.GpsFix) -> None:
        self.publish(fix, keep_time=True)
        valid = fix.validity & imc.GpsFix.Validity.VALID_POS
        words = f"{fix.satellites} satellites" if valid else "waiting for a fix"
        bad = self.receiver.bad
        self.set_entity_state(State.NORMAL, words + (f"; {bad} bad sentences" if bad else ""))


def parse_sentence(frame: bytes) -> Any:
    """An NMEA sentence, parsed by pynmeagps. Raises ValueError."""
    try:
        sentence = import_module("pynmeagps").NMEAReader.parse(frame)
    except Exception as error:  # its errors have no class of their own but Exception; damaged values raise any
        raise ValueError(error) from error
    if sentence is None:
        raise ValueError("pynmeagps does not know it")
    return sentence


def parse_ubx(frame: bytes) -> Any:
    """A UBX message, parsed by pyubx2. Raises ValueError."""
    try:
        return import_module("pyubx2").UBXReader.parse(frame)
    except Exception as error:
        raise ValueError(error) from error
