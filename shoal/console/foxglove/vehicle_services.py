"""Orders to vehicles as services: start and stop a plan, hold, surface, abort."""

import json
import struct
from collections.abc import Mapping
from typing import NamedTuple, cast

from shoal.console.foxglove.protocol import Json, ProtocolError, ServiceCall
from shoal.logs.export import ENCAPSULATION, cdr_string, ros_name

TRIGGER = "std_srvs/srv/Trigger"
START_PLAN = "imc_msgs/srv/StartPlan"
ORDERS = {"start_plan": "start", "stop_plan": "stop", "hold": "hold", "surface": "surface", "abort": "abort"}
"""Names of the services, and of the orders of the page that they are."""
_ANSWER = "bool success\nstring message\n"


class VehicleService(NamedTuple):
    """A service of a vehicle: its number, name, vehicle and order."""

    number: int
    name: str
    system: str
    order: str

    def advertisement(self) -> Json:
        kind = START_PLAN if self.order == "start" else TRIGGER
        request = "string plan\n" if self.order == "start" else ""
        return {
            "id": self.number,
            "name": self.name,
            "type": kind,
            "request": _definition(f"{kind}_Request", request),
            "response": _definition(f"{kind}_Response", _ANSWER),
        }


def _definition(name: str, text: str) -> Json:
    return {"encoding": "cdr", "schemaName": name, "schemaEncoding": "ros2msg", "schema": text}


class VehicleServices:
    """The services of all vehicles that have appeared; they keep their numbers."""

    def __init__(self) -> None:
        self.by_number: dict[int, VehicleService] = {}
        self._systems: set[str] = set()

    def of_systems(self, systems: list[str]) -> list[VehicleService]:
        """All services, also those of these vehicles if they are new."""
        for system in systems:
            if system in self._systems:
                continue
            self._systems.add(system)
            for name, order in ORDERS.items():
                number = len(self.by_number) + 1
                self.by_number[number] = VehicleService(number, f"/{ros_name(system)}/{name}", system, order)
        return list(self.by_number.values())


def call_words(service: VehicleService, call: ServiceCall) -> Mapping[str, str]:
    """The words of the order in a call. Raises ProtocolError."""
    if call.encoding not in ("cdr", "json"):
        raise ProtocolError(f"the encoding of a call is cdr or json, not {call.encoding!r}")
    if service.order != "start":
        return {}
    plan = _json_plan(call.data) if call.encoding == "json" else _cdr_plan(call.data)
    if not plan:
        raise ProtocolError("name a plan")
    return {"plan": plan}


def _json_plan(data: bytes) -> str:
    try:
        found: object = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"the request is not JSON: {error}") from None
    plan = cast(dict[str, object], found).get("plan") if isinstance(found, dict) else None
    if not isinstance(plan, str):
        raise ProtocolError('the request is {"plan": NAME}')
    return plan


def _cdr_plan(data: bytes) -> str:
    if len(data) < 8 or data[:2] not in (b"\0\0", b"\0\1"):
        raise ProtocolError("the request is a string in CDR")
    (length,) = struct.unpack_from("<I" if data[1] else ">I", data, 4)
    if not 0 < length <= len(data) - 8:
        raise ProtocolError("the request is a string in CDR")
    return data[8 : 8 + length - 1].decode(errors="replace")


def call_answer(call: ServiceCall, done: bool, text: str) -> bytes:
    """The answer to a call: whether the vehicle obeys, and a sentence for the operator."""
    if call.encoding == "json":
        return json.dumps({"success": done, "message": text}).encode()
    return ENCAPSULATION + bytes([done, 0, 0, 0]) + cdr_string(text.encode(errors="replace"))
