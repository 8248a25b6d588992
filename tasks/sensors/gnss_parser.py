"""Output of GNSS receivers, NMEA 0183 and UBX, as GpsFix messages; without input or output."""

import math
from collections.abc import Callable, Mapping
from datetime import date, time
from typing import Any

import imc
from runtime.devices import line_size_function
from support.rotations import wrap
from support.text_length import list_first
from support.wgs84 import is_on_earth

Valid = imc.GpsFix.Validity
Type = imc.GpsFix.Type

UBX = b"\xb5\x62"
LONGEST_SENTENCE = 256  # bytes; the limit of NMEA is 82, receivers send more
LONGEST_UBX = 1024  # bytes; NAV-SAT of 80 satellites
KNOT = 1852.0 / 3600.0  # m/s
KMH = 1.0 / 3.6
HEIGHT_KEPT = 10.0  # s that a height counts for positions without one
LATE_FIELDS = ("satellites", "utc_year", "utc_month", "utc_day", "sog", "cog", "hdop", "vdop", "hacc", "vacc")
NO_DILUTION = 99.0  # receivers send 99.99 while they have none
WANTED = (b"GGA,", b"GNS,", b"RMC,", b"VTG,", b"ZDA,", b"GSA,", b"GST,")
HEADINGS = (b"HDT,", b"HDM,", b"HDG,", b"THS,", b"ROT,")
LISTED = 4  # kinds of sentences in a text
BY_QUALITY = {1: Type.STANDALONE, 3: Type.STANDALONE, 6: Type.DEAD_RECKONING, 7: Type.MANUAL_INPUT, 8: Type.SIMULATION}
BY_MODE = {"A": Type.STANDALONE, "E": Type.DEAD_RECKONING, "M": Type.MANUAL_INPUT, "S": Type.SIMULATION}
BY_STATUS = {"G2": Type.STANDALONE, "G3": Type.STANDALONE, "DR": Type.DEAD_RECKONING, "RK": Type.DEAD_RECKONING}


def ubx_size(head: bytes) -> int | None:
    """The size of a UBX frame: two sync bytes, class, id, length, payload, two check bytes."""
    return None if len(head) < 6 else int.from_bytes(head[4:6], "little") + 8


KINDS: dict[bytes, Callable[[bytes], int | None]] = {b"$": line_size_function(LONGEST_SENTENCE), UBX: ubx_size}


def has_valid_checksum(frame: bytes) -> bool:
    """Whether the checksum of a sentence or UBX frame is right."""
    if frame.startswith(UBX):
        first = second = 0
        for byte in frame[2:-2]:
            first = (first + byte) & 0xFF
            second = (second + first) & 0xFF
        return frame[-2:] == bytes((first, second))
    content, star, rest = frame.strip()[1:].partition(b"*")
    check = 0
    for byte in content:
        check ^= byte
    return bool(star) and rest.upper() == b"%02X" % check


def is_relevant_sentence(sentence: bytes) -> bool:
    """Whether a sentence has fields of GpsFix."""
    return sentence[3:7] in WANTED or sentence.startswith(b"$PUBX,00,")


def is_heading_sentence(sentence: bytes) -> bool:
    """Whether a sentence has a heading or a turn rate."""
    return sentence[3:7] in HEADINGS


def is_unchecked_sentence(frame: bytes) -> bool:
    """Whether a frame is a sentence without a checksum, as older instruments send them."""
    content = frame.strip()
    return (
        content.startswith(b"$") and b"*" not in content and b"," in content and content.decode("latin").isprintable()
    )


def heading_message(kind: str, sentence: Any) -> imc.EulerAngles | imc.AngularVelocity | None:
    """The values of a sentence with a heading or a turn rate, parsed by pynmeagps; NaN for those that it lacks.

    None if it has no value, or one that its sender calls invalid. Raises ValueError for values that cannot be.
    """
    if kind.endswith("ROT"):
        rate = _number(sentence, "rot", math.radians(1.0) / 60.0)  # °/min, positive to starboard
        if rate is None or _text(sentence, "valid") not in ("A", ""):
            return None
        return imc.AngularVelocity(x=math.nan, y=math.nan, z=rate)
    true = _number(sentence, "headt" if kind.endswith("THS") else "headingT")
    if kind.endswith("THS") and _text(sentence, "mi") in ("S", "V"):  # of a simulator, or invalid
        return None
    magnetic = _number(sentence, "headingM")
    if magnetic is not None and kind.endswith("HDG"):
        magnetic += _eastward(sentence, "deviation")
        if isinstance(_text(sentence, "variation"), int | float):
            true = magnetic + _eastward(sentence, "variation")
    if true is None and magnetic is None:
        return None
    psi, psi_magnetic = (_course(value) for value in (true, magnetic))
    unknown = math.nan
    return imc.EulerAngles(
        phi=unknown,
        theta=unknown,
        psi=unknown if psi is None else psi,
        psi_magnetic=unknown if psi_magnetic is None else psi_magnetic,
    )


def _eastward(sentence: Any, name: str) -> float:
    """A deviation or variation (°), positive to the east; 0 if there is none."""
    return (_number(sentence, name) or 0.0) * (-1.0 if _text(sentence, f"{name}EW") == "W" else 1.0)


def describe_missing_fix(kinds: set[str], unchecked: set[str]) -> str:
    """Reason why a receiver that sends `kinds` of messages, or `unchecked` sentences, gives no fix; else empty."""
    if unchecked:
        named = list_first(sorted(unchecked), LISTED)
        return f"sentences have no checksum ({named}), and are left out: make the receiver send *hh"
    if kinds:
        return f"{list_first(sorted(kinds), LISTED)} received, but no fix: enable NAV-PVT, or the sentences GGA and RMC"
    return ""


class FixAssembler:
    """Joins the sentences of one moment to one GpsFix.

    `last` is the sentence that ends a moment, such as GPRMC or PUBX. Otherwise it is found: the last one that the two
    moments before had. A moment whose last sentence is missing ends when the next begins. Content of a sentence that
    comes seldom, and so after the end of its moment, is in the fix of the next one.

    A position without height, as of RMC, has the last one of the last 10 s, else NaN. A height above mean sea level
    without the separation of the geoid is taken with the last separation; before the first one it is unknown, too.
    """

    def __init__(self, last: str = ""):
        self._given = last
        self._last = last
        self._time: float | None = None
        self._kinds: list[str] = []
        self._before: list[str] = []
        self._fields: dict[str, Any] | None = None
        self._late: dict[str, Any] = {}
        self._separation: float | None = None
        self._height, self._height_at = math.nan, -math.inf

    def add(self, sentence: Any, now: float) -> list[imc.GpsFix]:
        """The fixes that a sentence, parsed by pynmeagps, completes. `now` (s) is when it arrived.

        Raises ValueError for values that cannot be.
        """
        kind, found = str(sentence.identity), list[imc.GpsFix]()
        values = gps_fix_fields(kind, sentence)
        at = values.get("utc_time")
        again = kind in self._kinds and not kind.endswith("GSA")
        if again or (at is not None and self._time is not None and at != self._time):
            found += self._end()
            if not self._given:
                common = [k for k in self._kinds if k in self._before or not self._before]
                self._last = common[-1] if common else ""
            self._before, self._kinds, self._time = self._kinds, [], None
        if not self._kinds:
            self._fields = {"timestamp": now, **self._late}
            self._late = {}
        self._kinds.append(kind)
        self._time = at if at is not None else self._time
        if self._fields is None:
            _merge(self._late, late_fields(values))
            self._complete_height({"timestamp": now, **values})
        else:
            _merge(self._fields, values)
            if self._last and (kind == self._last or kind.startswith(self._given or "\0")):
                found += self._end()
        return found

    def _end(self) -> list[imc.GpsFix]:
        fields, self._fields = self._fields, None
        if fields is None:
            return []
        self._complete_height(fields)
        return [imc.GpsFix(**fields)]

    def _complete_height(self, fields: dict[str, Any]) -> None:
        """Replace the height above mean sea level by that above the ellipsoid, as IMC has it."""
        above_sea, now = fields.pop("above_sea", None), fields["timestamp"]
        self._separation = fields.pop("separation", self._separation)
        if "height" not in fields and above_sea is not None and self._separation is not None:
            fields["height"] = above_sea + self._separation
        if "height" in fields:
            self._height, self._height_at = fields["height"], now
        elif fields.get("validity", 0) & Valid.VALID_POS:
            fields["height"] = self._height if now - self._height_at <= HEIGHT_KEPT else math.nan


def late_fields(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a sentence that may be joined to the fix of the next moment: all but time and position."""
    validity = values.get("validity", 0) & ~(Valid.VALID_TIME | Valid.VALID_POS)
    return {"validity": validity, **{name: values[name] for name in LATE_FIELDS if name in values}}


def _merge(fields: dict[str, Any], values: Mapping[str, Any]) -> None:
    validity = fields.get("validity", 0) | values.get("validity", 0)
    kind = fields.get("type", Type.STANDALONE)
    fields |= values
    fields["validity"] = validity
    if kind is not Type.STANDALONE:  # the more specific sentence, such as DIFFERENTIAL
        fields["type"] = kind


def gps_fix_fields(kind: str, sentence: Any) -> dict[str, Any]:
    """The fields of GpsFix that one sentence has; `above_sea` and `separation` (m) become its height.

    Raises ValueError for values that cannot be.
    """
    found: dict[str, Any] = {"validity": 0}
    if isinstance(at := getattr(sentence, "time", ""), time):
        found |= {"utc_time": at.hour * 3600.0 + at.minute * 60.0 + at.second + at.microsecond * 1e-6}
        found["validity"] |= Valid.VALID_TIME
    if isinstance(day := getattr(sentence, "date", ""), date):
        _date(found, day)
    elif kind.endswith("ZDA") and all(numbers := [_text(sentence, name) for name in ("year", "month", "day")]):
        _date(found, _day(*numbers))
    _position(found, kind, sentence)

    def number(name: str, factor: float = 1.0) -> float | None:
        return _number(sentence, name, factor)

    for name, flag in (("hdop", Valid.VALID_HDOP), ("vdop", Valid.VALID_VDOP)):
        value = number(name.upper())
        _put(found, name, value if value is not None and value < NO_DILUTION else None, flag)
    if kind == "PUBX00":
        _put(found, "hacc", number("hAcc"), Valid.VALID_HACC)
        _put(found, "vacc", number("vAcc"), Valid.VALID_VACC)
    elif kind.endswith("GST"):
        north, east = number("stdLat"), number("stdLong")
        _put(found, "hacc", None if north is None or east is None else math.hypot(north, east), Valid.VALID_HACC)
        _put(found, "vacc", number("stdAlt"), Valid.VALID_VACC)
    for name, factor in (("sogk", KMH), ("SOG", KMH), ("spd", KNOT)):
        _put(found, "sog", number(name, factor), Valid.VALID_SOG)
    for name in ("cogt", "COG", "cog"):
        _put(found, "cog", _course(number(name)), Valid.VALID_COG)
    satellites = getattr(sentence, "numSVs", getattr(sentence, "numSV", ""))
    if isinstance(satellites, int):
        found["satellites"] = min(satellites, 0xFF)
    return found


def _position(found: dict[str, Any], kind: str, sentence: Any) -> None:
    """Latitude, longitude and height, if the sentence marks them as valid."""
    valid = Type.STANDALONE
    if kind.endswith("GGA"):
        quality = _text(sentence, "quality")
        ok, valid = bool(quality), BY_QUALITY.get(quality, Type.DIFFERENTIAL)
    elif kind == "PUBX00":
        status = _text(sentence, "navStat")
        ok, valid = status not in ("", "NF", "TT"), BY_STATUS.get(status, Type.DIFFERENTIAL)
    elif kind.endswith("RMC"):
        mode = _text(sentence, "posMode") or "A"  # not before NMEA 2.3
        ok, valid = _text(sentence, "status") == "A", BY_MODE.get(mode, Type.DIFFERENTIAL)
    elif kind.endswith("GNS"):
        modes = str(_text(sentence, "posMode")).strip("N")
        ok, valid = bool(modes), BY_MODE.get(modes[:1], Type.DIFFERENTIAL)
    else:
        return
    lat, lon = _number(sentence, "lat"), _number(sentence, "lon")
    if not ok or lat is None or lon is None:
        return
    if not is_on_earth(math.radians(lat), math.radians(lon)):
        raise ValueError(f"no place on Earth: {lat:g}, {lon:g}")
    found |= {"lat": math.radians(lat), "lon": math.radians(lon), "type": valid}
    found["validity"] |= Valid.VALID_POS
    for name, field in (("height", "altRef"), ("above_sea", "alt"), ("separation", "sep")):
        if (value := _number(sentence, field)) is not None:
            found[name] = value


def _text(sentence: Any, name: str) -> Any:
    """A field of a sentence; a short one does not have all of them."""
    return getattr(sentence, name, "")


def _day(year: int, month: int, day: int) -> date:
    try:
        return date(year, month, day)
    except OverflowError:
        raise ValueError(f"no date: {year}-{month}-{day}") from None


def _date(found: dict[str, Any], day: date) -> None:
    found |= {"utc_year": day.year, "utc_month": day.month, "utc_day": day.day}
    found["validity"] |= Valid.VALID_DATE


def _put(found: dict[str, Any], name: str, value: float | None, flag: int) -> None:
    if value is not None:
        found[name] = value
        found["validity"] |= flag


def _number(sentence: Any, name: str, factor: float = 1.0) -> float | None:
    value = getattr(sentence, name, "")
    if not isinstance(value, int | float):
        return None
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}")
    return value * factor


def _course(degrees: float | None) -> float | None:
    return None if degrees is None else wrap(math.radians(degrees))


def fix_from_ubx(pvt: Any, dop: Any | None) -> imc.GpsFix:
    """The fix of a UBX NAV-PVT, parsed by pyubx2, and of the last NAV-DOP. Raises ValueError for impossible values."""
    if not hasattr(pvt, "numSV"):
        raise ValueError("a poll request, not a fix")
    found: dict[str, Any] = {"validity": 0, "satellites": pvt.numSV}
    if pvt.validDate:
        _date(found, date(pvt.year, pvt.month, pvt.day))
    if pvt.validTime:
        found["utc_time"] = max(0.0, pvt.hour * 3600.0 + pvt.min * 60.0 + pvt.second + pvt.nano * 1e-9)
        found["validity"] |= Valid.VALID_TIME
    if pvt.gnssFixOk and pvt.fixType in (1, 2, 3, 4):
        if abs(pvt.lat) > 90.0 or abs(pvt.lon) > 180.0:
            raise ValueError(f"no place on Earth: {pvt.lat:g}, {pvt.lon:g}")
        kind = Type.DEAD_RECKONING if pvt.fixType == 1 else Type.DIFFERENTIAL if pvt.diffSoln else Type.STANDALONE
        found |= {"type": kind, "lat": math.radians(pvt.lat), "lon": math.radians(pvt.lon)}
        found |= {"height": pvt.height * 1e-3}
        found["validity"] |= Valid.VALID_POS
        _put(found, "sog", pvt.gSpeed * 1e-3, Valid.VALID_SOG)
        _put(found, "cog", _course(pvt.headMot), Valid.VALID_COG)
        _put(found, "hacc", pvt.hAcc * 1e-3, Valid.VALID_HACC)
        _put(found, "vacc", pvt.vAcc * 1e-3, Valid.VALID_VACC)
    if dop is not None and dop.hDOP < NO_DILUTION:
        _put(found, "hdop", dop.hDOP, Valid.VALID_HDOP)
        _put(found, "vdop", dop.vDOP, Valid.VALID_VDOP)
    return imc.GpsFix(**found)
