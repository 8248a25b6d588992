"""GPS receivers: NMEA 0183, and UBX of u-blox."""

from importlib import import_module
from typing import Any

import imc
from runtime import State, Task, expect, param
from runtime.devices import Device, FrameSplitter
from tasks.sensors.gnss_parser import (
    KINDS,
    LONGEST_UBX,
    UBX,
    FixAssembler,
    describe_missing_fix,
    fix_from_ubx,
    has_valid_checksum,
    heading_message,
    is_heading_sentence,
    is_relevant_sentence,
    is_unchecked_sentence,
)

UBX_FIRST = 5.0  # s after a UBX fix, in which NMEA fixes are left out: a receiver may send both
MOST_KINDS = 32
NAV_PVT, NAV_DOP = b"\x01\x07", b"\x01\x04"


class GPS(Task):
    """Publishes GpsFix, with a validity bit for each value that the receiver reports.

    The sentences of one moment (GGA or GNS, RMC, VTG, ZDA, GSA, GST, PUBX,00) become one fix. A receiver of u-blox may
    also send NAV-PVT, and NAV-DOP before it, instead of them. Damaged sentences are left out, and counted. Headings
    (HDT, HDM, HDG, THS) become EulerAngles and turn rates (ROT) AngularVelocity, with NaN for missing values.
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
        [],
        "",
        "NMEA sentences of a fix, such as GPGGA, GPRMC; the last one ends it. Empty: automatic.",
        editable=False,
    )

    def start(self) -> None:
        self.epochs: FixAssembler = FixAssembler(self.sentence_order[-1] if self.sentence_order else "")
        self.dilution: Any = None  # the last NAV-DOP
        self.ubx_at = -UBX_FIRST
        self.others: dict[str, float] = {}  # s, when messages without a fix came last, by kind
        self.unchecked: dict[str, float] = {}  # the same of sentences without a checksum
        split = FrameSplitter(KINDS, valid=self.is_valid, longest=LONGEST_UBX)
        self.receiver: Device = self.serial(self.port, self.baud, frames=self.receive_frame, split=split)
        self.receiver.explain = self.explain_missing_fix

    def is_valid(self, frame: bytes) -> bool:
        if is_unchecked_sentence(frame):
            note_kind(self.unchecked, frame[1:].split(b",")[0].decode("latin"), self.now)
        return has_valid_checksum(frame)

    def explain_missing_fix(self, seconds: float) -> str:
        """The input of the last seconds that came in the place of a fix."""
        recent = (
            {kind for kind, at in seen.items() if self.now - at <= seconds} for seen in (self.others, self.unchecked)
        )
        return describe_missing_fix(*recent)

    def receive_frame(self, frame: bytes) -> None:
        if frame.startswith(UBX):
            self.receive_ubx(frame)
        elif is_heading_sentence(frame):
            sentence = parse_sentence(frame)
            note_kind(self.others, str(sentence.identity), self.now)
            if (message := heading_message(str(sentence.identity), sentence)) is not None:
                self.publish(message)
        elif is_relevant_sentence(frame) and self.age(self.ubx_at) >= UBX_FIRST:
            for fix in self.epochs.add(parse_sentence(frame), self.now):
                self.report(fix)
        elif self.age(self.ubx_at) >= UBX_FIRST:
            note_kind(self.others, frame[1:].split(b",")[0].decode("latin"), self.now)

    def receive_ubx(self, frame: bytes) -> None:
        kind = frame[2:4]
        if kind == NAV_DOP:
            self.dilution = parse_ubx(frame)
        elif kind == NAV_PVT:
            self.ubx_at: float = self.now
            self.report(fix_from_ubx(parse_ubx(frame), self.dilution).replace(timestamp=self.now))
        else:
            name = import_module("pyubx2").UBX_MSGIDS.get(kind, kind.hex("-"))
            note_kind(self.others, f"UBX {name}", self.now)

    @expect(every="input_timeout")
    def report(self, fix: imc.GpsFix) -> None:
        self.publish(fix, keep_time=True)
        valid = fix.validity & imc.GpsFix.Validity.VALID_POS
        words = f"{fix.satellites} satellites" if valid else "waiting for a fix"
        bad = self.receiver.bad
        self.set_entity_state(State.NORMAL, words + (f"; {bad} bad sentences" if bad else ""))


def note_kind(seen: dict[str, float], kind: str, now: float) -> None:
    """Note when a kind of message came last; of a stranger's, the first MOST_KINDS."""
    if kind in seen or len(seen) < MOST_KINDS:
        seen[kind] = now


def parse_sentence(frame: bytes) -> Any:
    """An NMEA sentence, parsed by pynmeagps. Raises ValueError."""
    try:
        sentence = import_module("pynmeagps").NMEAReader.parse(frame)
    except Exception as error:  # its errors have no class of their own but Exception; damaged values raise any
        raise ValueError(error) from error
    if sentence is None:
        raise ValueError("pynmeagps does not support it")
    return sentence


def parse_ubx(frame: bytes) -> Any:
    """A UBX message, parsed by pyubx2. Raises ValueError."""
    try:
        return import_module("pyubx2").UBXReader.parse(frame)
    except Exception as error:
        raise ValueError(error) from error
