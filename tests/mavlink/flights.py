"""Writes DataFlash and ULog files as ArduPilot and PX4 do: none that may be copied is small enough."""

import struct

SIZES = {letter: letter for letter in "bBhHiIfdqQ"}
SIZES |= {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}
PARTS = {"c": 100, "C": 100, "e": 100, "E": 100, "L": 1e7}
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"


KINDS = {
    "PARM": ("QNff", "TimeUS,Name,Value,Default"),
    "MSG": ("QZ", "TimeUS,Message"),
    "ATT": ("QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF"),
    "POS": ("QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "XKF1": ("QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH"),
    "XKF4": ("QBcccccfffHBIHb", "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI"),
    "IMU": ("QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"),
    "MAG": ("QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S"),
    "BARO": ("QBffcfIffB", "TimeUS,I,Alt,Press,Temp,CRt,SMS,Offset,GndTemp,H"),
    "GPS": ("QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
    "GPA": ("QBCCCCfBIHfHH", "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,Und,RTCMFU,RTCMFD"),
    "BAT": ("QBfffffcfBBB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH"),
    "RFND": ("QBCBBb", "TimeUS,Instance,Dist,Stat,Orient,Quality"),
    "MODE": ("QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ERR": ("QBB", "TimeUS,Subsys,ECode"),
    "EV": ("QB", "TimeUS,Id"),
}


class DataFlashWriter:
    """Declares each kind of record, with the formats of ArduPilot 4.5, at its first use."""

    def __init__(self):
        self.data = b""
        self._numbers = {}
        self._declare(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def add(self, time, name, **values):
        """A record at `time` s; fields that are not given are 0."""
        letters, columns = KINDS[name]
        if name not in self._numbers:
            self._numbers[name] = 129 + len(self._numbers)
            self._declare(self._numbers[name], name, letters, columns)
        values = {"TimeUS": round(time * 1e6), **values}
        assert not set(values).difference(columns.split(","))
        found = [_raw(letter, values.get(column)) for letter, column in zip(letters, columns.split(","), strict=True)]
        self.data += bytes((0xA3, 0x95, self._numbers[name])) + struct.pack(_layout(letters), *found)
        return self

    def _declare(self, number, name, letters, columns):
        texts = [text.encode() for text in (name, letters, columns)]
        fields = struct.pack("<BB4s16s64s", number, 3 + struct.calcsize(_layout(letters)), *texts)
        self.data += b"\xa3\x95\x80" + fields


class ULogWriter:
    """Declares each topic, with the fields of the first values, at its first use."""

    def __init__(self, start=1.0):
        self._body = b""
        self._head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(start * 1e6))
        self._message("B", bytes(40))
        self._numbers = {}

    @property
    def data(self):
        return self._head + self._body

    def parameter(self, name, value):
        key = f"{'int32_t' if isinstance(value, int) else 'float'} {name}".encode()
        self._message("P", bytes((len(key),)) + key + struct.pack("<i" if isinstance(value, int) else "<f", value))
        return self

    def text(self, time, level, words):
        self._message("L", struct.pack("<BQ", ord(str(level)), round(time * 1e6)) + words.encode())
        return self

    def dropout(self, milliseconds):
        self._message("O", struct.pack("<H", milliseconds))
        return self

    def sync(self):
        self._message("S", SYNC)
        return self

    def add(self, time, topic, instance=0, **fields):
        """A message of a topic: fields are (letter of struct, value), a list for an array."""
        fields = {"timestamp": ("Q", round(time * 1e6)), **fields}
        types = {"Q": "uint64_t", "f": "float", "d": "double", "i": "int32_t", "B": "uint8_t", "?": "bool"}
        if (topic, instance) not in self._numbers:
            number = self._numbers[topic, instance] = len(self._numbers)
            words = [
                f"{types[letter]}[{len(value)}] {name};" if isinstance(value, list) else f"{types[letter]} {name};"
                for name, (letter, value) in fields.items()
            ]
            self._message("F", f"{topic}:{''.join(words)}uint8_t[3] _padding0;".encode())
            self._message("A", struct.pack("<BH", instance, number) + topic.encode())
        values = [
            (letter, one)
            for letter, value in fields.values()
            for one in (value if isinstance(value, list) else [value])
        ]
        packed = struct.pack("<" + "".join(letter for letter, _ in values), *(value for _, value in values))
        self._message("D", struct.pack("<H", self._numbers[topic, instance]) + packed)
        return self

    def _message(self, kind, content):
        message = struct.pack("<HB", len(content), ord(kind)) + content
        if kind in "BFIP":  # pyulog wants these before the others
            self._head += message
        else:
            self._body += message


def _layout(letters):
    return "<" + "".join(SIZES[letter] for letter in letters)


def _raw(letter, value):
    if letter in "nNZ":
        return (value or "").encode()
    return round((value or 0) * PARTS[letter]) if letter in PARTS else value or 0
