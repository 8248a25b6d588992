"""Messages that a multirotor gets while it is controlled."""

import math

import imc

Loops, Flags, Units = imc.CLoopsMask, imc.DesiredPath.Flags, imc.ZUnits
LAT, LON = math.radians(41.185), math.radians(-8.7062)
FIX = imc.GpsFix(type=imc.GpsFix.Type.MANUAL_INPUT, lat=LAT, lon=LON, timestamp=0.0)
ARMED, DISARMED = imc.ArmingState.State.ARMED, imc.ArmingState.State.DISARMED
OWN = 0x001A


def enable(mask=Loops.PATH, scope=1, time=0.1, on=1):
    return imc.ControlLoops(timestamp=time, enable=on, mask=mask, scope_ref=scope)


def states(seconds=1.0, start=0.2, **fields):
    fields = {"lat": LAT, "lon": LON, "height": 80.0, "z": -10.0, "alt": 10.0, "depth": -1.0, **fields}
    return [imc.EstimatedState(timestamp=start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def velocity(time, u=0.0, v=0.0, w=0.0, until=None):
    """A desired velocity, repeated at 10 Hz."""
    count = 1 if until is None else round((until - time) * 10)
    return [imc.DesiredVelocity(timestamp=time + 0.1 * i, u=u, v=v, w=w) for i in range(count)]
