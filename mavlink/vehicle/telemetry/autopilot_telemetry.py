"""The autopilot as a component that sends telemetry, by the streams that it offers."""

from collections.abc import Mapping, Sequence

from mavlink import Dialect, Fields, Flavor, ReceivedMessage
from mavlink.vehicle.model import AUTOPILOT
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session
from mavlink.vehicle.telemetry.streams import STREAMS
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext

LOW: Mapping[str, float] = {name: stream.low for name, stream in STREAMS.items()}
"""The default rates of slow links."""


class AutopilotTelemetry:
    """The messages of the autopilot, for sessions."""

    component = AUTOPILOT

    def __init__(self, dialect: Dialect, sources: TelemetryContext) -> None:
        self.dialect = dialect
        self.system: int = sources.model.system
        self.sources = sources

    @property
    def latest_notices(self) -> Sequence[tuple[int, str]]:
        return list(self.sources.model.notices)

    def rates(self, low: bool) -> Mapping[str, float]:
        return LOW if low else self.sources.model.options.rates

    def offers(self, name: str) -> bool:
        return name in STREAMS

    def fields(self, name: str, flavor: Flavor, now: float, number: int = 0) -> Sequence[Fields]:
        return STREAMS[name].build_message_fields(self.sources, flavor, now, number)


class StreamService(MavlinkService):
    """The older way to choose rates, by groups of messages."""

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {"REQUEST_DATA_STREAM": self._request}

    def _request(self, session: Session, message: ReceivedMessage, now: float) -> None:
        values = message.values
        group, rate = values["req_stream_id"], values["req_message_rate"] if values["start_stop"] else 0
        for name, stream in STREAMS.items():
            if stream.group and group in (0, stream.group):
                session.set_period(name, 1.0 / rate if rate else 0.0)
