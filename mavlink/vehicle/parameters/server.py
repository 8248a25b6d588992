"""The parameter protocol: stations list, read and set parameters; all of them receive each change."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import imc
from mavlink import ReceivedMessage, statustext
from mavlink.vehicle.interfaces import VehiclePort
from mavlink.vehicle.parameters.table import (
    DOES_NOT_EXIST,
    PERMISSION_DENIED,
    ParameterEntry,
    ParameterRefusal,
    ParameterTable,
)
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session

SET_TIMEOUT = 0.25  # s for the vehicle's answer


class ParameterServer(MavlinkService):
    """Shows and sets the parameters of a table; `sessions()` are those that receive changes."""

    def __init__(self, table: ParameterTable, port: VehiclePort, sessions: Callable[[], Iterable[Session]]) -> None:
        self._table = table
        self._port = port
        self._sessions = sessions
        self._pending: dict[str, tuple[float, ParameterEntry]] = {}
        self._shown = {entry.id: entry.value for entry in table}

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {"PARAM_REQUEST_LIST": self._list, "PARAM_REQUEST_READ": self._read, "PARAM_SET": self._set}

    def poll(self, now: float) -> None:
        """Send the old value of what the vehicle was asked to change and did not answer."""
        for due, entry in list(self._pending.values()):
            if now >= due:
                self._show(entry)

    @property
    def next_deadline(self) -> float | None:
        return min((due for due, _ in self._pending.values()), default=None)

    def send_changed_parameters(self, reply: imc.EntityParameters) -> None:
        """Send changed parameters to all ground stations, also those set elsewhere."""
        for item in reply.params:
            entry = (
                self._table.find_entity_parameter(reply.name, item.name)
                if isinstance(item, imc.EntityParameter)
                else None
            )
            if entry is None:
                continue
            asked = [each for _, each in self._pending.values() if each.view is entry.view]
            if asked or entry.value != self._shown[entry.id]:
                for shown in {each.id: each for each in (entry, *asked)}.values():
                    self._show(shown)

    def _show(self, entry: ParameterEntry) -> None:
        self._pending.pop(entry.id, None)
        self._shown[entry.id] = entry.value
        for session in self._sessions():
            self._send(session, entry)

    def _send(self, session: Session, entry: ParameterEntry) -> None:
        payload = session.source.dialect.by_name["PARAM_VALUE"].pack(
            {
                "param_id": entry.id.encode(),
                "param_type": entry.type,
                "param_index": entry.index,
                "param_count": len(self._table),
            }
        )
        # As bytes: those of an integer may be a signaling NaN, which packing as a float would change.
        session.send_payload("PARAM_VALUE", entry.encoded(session.flavor) + payload[4:])

    def _list(self, session: Session, message: ReceivedMessage, now: float) -> None:
        session.start_list_transfer([partial(self._send, session, entry) for entry in self._table], now)

    def _read(self, session: Session, message: ReceivedMessage, now: float) -> None:
        index, name = message.values["param_index"], message.values["param_id"]
        entry = self._table.named(name) if index == -1 else self._table.at(index)
        if entry is not None:
            self._send(session, entry)
        else:
            session.reply(message, "PARAM_ERROR", param_id=name, param_index=index, error=DOES_NOT_EXIST)

    def _set(self, session: Session, message: ReceivedMessage, now: float) -> None:
        name = message.values["param_id"]
        entry = self._table.named(name)
        if entry is None:
            session.reply(message, "PARAM_ERROR", param_id=name, param_index=-1, error=DOES_NOT_EXIST)
            return
        try:
            if session.refusal:
                raise ParameterRefusal(PERMISSION_DENIED, session.refusal)
            wanted = entry.decode_param_value(message.payload[:4], message.values["param_type"], session.flavor)
        except ParameterRefusal as refusal:
            session.reply(message, "PARAM_ERROR", param_id=name, param_index=entry.index, error=refusal.code)
            self._send(session, entry)
            session.send_statustext(statustext.WARNING, f"{entry.view.label}, {entry.declaration.name}: {refusal}", now)
            return
        self._port.set_parameter(entry.view.label, entry.declaration.name, wanted)
        self._pending.setdefault(entry.id, (now + SET_TIMEOUT, entry))
