"""The hand of a test on the stand-in: how it is started, what pilots, cables, thieves and bad luck do to it."""

import argparse
import math
import os

from pymavlink.dialects.v20 import ardupilotmega as mavlink

BODIES = ("rover", "boat", "submarine", "plane")
KINDS = ("copter", *BODIES, "px4", *(f"px4-{body}" for body in BODIES))


def parse_options(arguments=None):
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("--kind", default="copter", choices=KINDS)
    parser.add_argument("--system", type=int, default=7)
    parser.add_argument("--north", type=float, default=0.0)
    parser.add_argument("--wind", type=float, default=0.0, help="m/s toward the north")
    parser.add_argument("--loss", type=float, default=0.0, help="part of the messages that is lost, each way")
    parser.add_argument("--seed", type=int, default=7, help="of what is lost")
    parser.add_argument("--of-loss", type=float, default=1.0, help="s without setpoints that end offboard")
    parser.add_argument("--old", action="store_true", help="knows no SET_MESSAGE_INTERVAL, and addresses no answers")
    parser.add_argument("--unready", action="store_true", help="refuses to arm")
    parser.add_argument("--tcp", action="store_true", help="serves the port over TCP")
    parser.add_argument("--waits", action="store_true", help="serves the port over UDP, and never speaks first")
    parser.add_argument("--serial", type=int, default=0, help="a file descriptor instead of the port")
    parser.add_argument("--diary", default="", help="a file for time, mode, arming and position, each second")
    parser.add_argument("--key", default="", help="signs, and wants signatures")
    return parser.parse_args(arguments)


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
    elif word == "ignore":  # what it accepts, and does not do: speed, or the first of its targets
        a.ignored[rest[0]] = int(rest[1]) if len(rest) > 1 else 0
    elif word == "deaf":
        a.deaf.add(int(rest[0]))
    elif word == "hear":
        a.deaf.discard(int(rest[0]))
    elif word == "unheard":  # its next acknowledgment of a command is lost
        a.unheard.add(int(rest[0]))
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
