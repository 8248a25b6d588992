"""Requests about time: the delay of a station, and the vehicle's clock."""

from collections.abc import Mapping

from mavlink import ReceivedMessage
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session


class ClockService(MavlinkService):
    """PING and TIMESYNC."""

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {"PING": self._ping, "TIMESYNC": self._timesync}

    def _ping(self, session: Session, message: ReceivedMessage, now: float) -> None:
        if message.values["target_system"] == 0:
            session.reply(message, "PING", time_usec=message.values["time_usec"], seq=message.values["seq"])

    def _timesync(self, session: Session, message: ReceivedMessage, now: float) -> None:
        if message.values["tc1"] == 0:
            session.reply(message, "TIMESYNC", tc1=round(now * 1e9), ts1=message.values["ts1"])
