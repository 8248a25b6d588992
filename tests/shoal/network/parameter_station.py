"""A station that keeps parameters as a DUNE does, and obeys each copy of an order."""

from collections.abc import Iterable, Sequence

import imc
from tests.shoal.network.station import Station

DUNE = "2026.01.0"
LABELS = {"Path Control": 7, "GPS": 9}
TASKS = {7: "Control.Path.LOSNSMC", 9: "Sensors.GPS"}


class ParameterStation(Station):
    """Entities with parameters, `values`. It takes no value that is in `refused`, and says nothing then.

    `deaf` are types that it ignores; it obeys one of `mute_after`, and answers nothing from then on. Without `types` it
    does not know QueryTypedEntityParameters.
    """

    def __init__(self, ports: Sequence[int], name: str = "station", system: int = 0x0B01, version: str = DUNE) -> None:
        super().__init__(ports, name, system, version=version)
        self.values = {
            "Path Control": {"Corridor -- Width": "1.5", "Course Control": "false"},
            "GPS": {"Serial Port - Device": "/dev/ttyS1"},
        }
        self.refused = {"wide"}
        self.deaf: set[type[imc.Message]] = set()
        self.mute_after: tuple[type[imc.Message], ...] = ()
        self.types = False

    def answers(self, message: imc.Message) -> Iterable[imc.Message]:
        found = list(self._obey(message))
        return [] if any(isinstance(each, self.mute_after) for each in self.heard) else found

    def _obey(self, message: imc.Message) -> Iterable[imc.Message]:
        if type(message) in self.deaf:
            return
        if isinstance(message, imc.EntityList) and message.op == imc.EntityList.Op.QUERY:
            entries = ";".join(f"{label}={number}" for label, number in LABELS.items())
            yield imc.EntityList(op=imc.EntityList.Op.REPORT, list=entries)
        elif isinstance(message, imc.QueryEntityInfo) and message.dst_ent in TASKS:
            number = message.dst_ent
            label = next(label for label, other in LABELS.items() if other == number)
            yield imc.EntityInfo(id=number, label=label, component=TASKS[number], src_ent=number)
        elif isinstance(message, imc.QueryEntityParameters) and message.name in self.values:
            yield self._report(message.name, self.values[message.name])
        elif isinstance(message, imc.SetEntityParameters) and message.name in self.values:
            known = self.values[message.name]
            entries = [entry for entry in message.params if isinstance(entry, imc.EntityParameter)]
            accepted = {e.name: e.value for e in entries if e.name in known and e.value not in self.refused}
            known.update(accepted)
            if accepted:
                yield self._report(message.name, accepted)
        elif isinstance(message, imc.QueryTypedEntityParameters) and self.types:
            yield self._typed(message)

    def _report(self, entity: str, values: dict[str, str]) -> imc.EntityParameters:
        params = tuple(imc.EntityParameter(name=name, value=text) for name, text in sorted(values.items()))
        return imc.EntityParameters(name=entity, params=params)

    def _typed(self, request: imc.QueryTypedEntityParameters) -> imc.QueryTypedEntityParameters:
        kinds, seen = imc.TypedEntityParameter.Type, imc.TypedEntityParameter.Visibility
        width = imc.TypedEntityParameter(
            name="Corridor -- Width",
            type=kinds.FLOAT,
            default_value=self.values["Path Control"]["Corridor -- Width"],
            units="m",
            min_value=0.1,
            max_value=50.3,
            visibility=seen.USER,
            scope=imc.TypedEntityParameter.Scope.MANEUVER,
        )
        course = imc.TypedEntityParameter(
            name="Course Control", type=kinds.BOOL, visibility=seen.DEVELOPER_NOT_EDITABLE, default_value="false"
        )
        mine = (width, course) if request.entity_name == "Path Control" else ()
        op = imc.QueryTypedEntityParameters.Op.REPLY
        return imc.QueryTypedEntityParameters(
            op=op, request_id=request.request_id, entity_name=request.entity_name, parameters=mine
        )
