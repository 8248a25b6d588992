"""Messages of a vehicle in the logs that tests write."""

import imc

START = 1_767_225_600.0
VEHICLE, OTHER, OPERATOR = 0x001A, 0x0015, 0x4001


def at(seconds, kind=imc.Voltage, **fields):
    """A message of the vehicle's entity 7, `seconds` after the start."""
    return kind(**{"timestamp": START + seconds, "src": VEHICLE, "src_ent": 7, **fields})


def labels(**entities):
    """What the vehicle reports of its entities."""
    return [at(0, imc.EntityInfo, label=label, src_ent=number, id=number) for label, number in entities.items()]
