"""The hand of a test on the stand-in: what pilots, cables, thieves and bad luck do to an autopilot."""

import math
import os

from pymavlink.dialects.v20 import ardupilotmega as mavlink


def handle(a, line):
    word, *rest = line.split()
    if word == "mode":
        a.switch(int(rest[0]))
    elif word == "disarm":
        a.armed = False
    elif word == "quiet":
        a.quiet.add(int(rest[0]))
    elif word == "gps":
        a.gps = rest[0] == "back"
    elif word == "reboot":
        a.boot()
        a.silent_until = a.now + 1.0
    elif word == "silent":
        a.silent_until = a.now + float(rest[0])
    elif word == "clock":
        a.shift += float(rest[0])
    elif word == "refuse":
        a.refused[int(rest[0])] = int(rest[1])
    elif word == "deaf":
        a.deaf.add(int(rest[0]))
    elif word == "mumble":
        a.mumbles = True
    elif word == "swap":
        a.store.items = a.store.items[:-1]
        a.store.identity += 1
    elif word == "nan":
        a.link.attitude_send(a.ms, math.nan, 0.0, math.inf, 0.0, 0.0, 0.0)
    elif word == "forge":
        forge(a)
    elif word == "garbage":
        for size in range(1, 200, 7):
            a.wire.write(bytes((0xFD, size & 0xFF)) + os.urandom(size))


def forge(a):
    """What somebody without the key says, or a cable breaks: the north pole."""
    liar = mavlink.MAVLink(a.wire, srcSystem=a.options.system, srcComponent=1)
    lie = mavlink.MAVLink_global_position_int_message(a.ms, 900000000, 0, 0, 0, 0, 0, 0, 0)
    frame = lie.pack(liar)
    a.wire.write(frame)
    a.wire.write(frame[:-2] + bytes((frame[-2] ^ 1, frame[-1])))
