"""Files and logs on their way to ground stations, a few packets at a time."""

from collections.abc import Mapping
from functools import partial
from weakref import WeakKeyDictionary

from mavlink import ReceivedMessage, statustext
from mavlink.missions import first_item_seq
from mavlink.vehicle.files.ftp_server import FtpServer
from mavlink.vehicle.files.log_server import LogServer
from mavlink.vehicle.files.virtual_files import VirtualFiles
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import PACKETS_AT_ONCE, Session

LOGS = b"logs"
Asker = tuple[Session, int, int]


class FileAndLogTransfer(MavlinkService):
    """Transfer of the virtual files and the logs to stations; each gets only what it asked for itself.

    All readers share PACKETS_AT_ONCE in a period, each at least one packet, so that many delay no other service.
    """

    def __init__(self, files: VirtualFiles) -> None:
        self._files = FtpServer(files)
        self._logs = LogServer(files, LOGS)
        self._readers: WeakKeyDictionary[Session, dict[tuple[int, int], ReceivedMessage]] = WeakKeyDictionary()

    @property
    def handlers(self) -> Mapping[str, Handler]:
        requests = ("FILE_TRANSFER_PROTOCOL", "LOG_REQUEST_LIST", "LOG_REQUEST_DATA", "LOG_REQUEST_END")
        return {**dict.fromkeys(requests, self.receive), "LOG_ERASE": self._erase}

    def receive(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Answer a request for a file or log, or begin to."""
        asker = session, message.system, message.component
        if message.name == "FILE_TRANSFER_PROTOCOL":
            answer = self._files.receive(asker, bytes(message.values["payload"]), now)
            if answer is not None:
                session.reply(message, message.name, payload=answer)
        else:
            first = first_item_seq(session.flavor)  # ArduPilot also counts logs from 1
            self._logs.receive(asker, message.name, message.values, now, first=first)
        if self._is_busy(asker):
            self._readers.setdefault(session, {})[asker[1:]] = message
            session.start_file_transfer(partial(self._send, session))

    def check_timeouts(self, now: float) -> None:
        """Close transfers that were not read for some time."""
        self._files.forget_silent(now)
        self._logs.forget_silent(now)

    def forget(self, session: Session) -> None:
        self._readers.pop(session, None)

    def close(self) -> None:
        """Close all files."""
        self._files.close()
        self._logs.close()

    def _send(self, session: Session, now: float) -> bool:
        """Send the next packets to the readers of a session; whether there are more."""
        readers = self._readers.get(session, {})
        for reader, message in list(readers.items()):
            asker = session, *reader
            for _ in range(self._packets_of_each):
                if self._files.is_busy(asker) and (payload := self._files.next_payload(asker, now)) is not None:
                    session.reply(message, "FILE_TRANSFER_PROTOCOL", payload=payload)
                if (said := self._logs.next_message(asker, now)) is not None:
                    session.send(said[0], said[1])
            if not self._is_busy(asker):
                del readers[reader]
        return bool(readers)

    @property
    def _packets_of_each(self) -> int:
        return max(1, PACKETS_AT_ONCE // sum(map(len, self._readers.values())))  # integers

    def _erase(self, session: Session, message: ReceivedMessage, now: float) -> None:
        session.send_statustext(statustext.WARNING, "Logs are not erased by ground stations", now)

    def _is_busy(self, asker: Asker) -> bool:
        return self._files.is_busy(asker) or self._logs.is_busy(asker)
