"""Files and logs on their way to ground stations, a few packets at a time."""

from typing import TYPE_CHECKING

from mavlink import ReceivedMessage
from mavlink.missions import first_item
from tasks.transports.mavlink_protocol.file_tree import FileTree
from tasks.transports.mavlink_protocol.files import FileServer
from tasks.transports.mavlink_protocol.log_transfer import LogServer

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.session import Session

PERIOD = 0.005  # s
AT_ONCE = 8  # packets in a period
LOGS = "logs"
Asker = tuple[int, int, int]


class Transfers:
    """What stations read of the files in a tree; each gets only what it asked for itself."""

    def __init__(self, tree: FileTree) -> None:
        self._files = FileServer(tree)
        self._logs = LogServer(tree, LOGS.encode())

    def hear(self, session: "Session", message: ReceivedMessage, now: float) -> None:
        """Answer a request for a file or log, or begin to."""
        asker = id(session), message.system, message.component
        if message.name == "FILE_TRANSFER_PROTOCOL":
            answer = self._files.hear(asker, bytes(message.values["payload"]), now)
            if answer is not None:
                session.answer(message, message.name, payload=answer)
        else:
            first = first_item(session.flavour)  # ArduPilot also counts logs from 1
            self._logs.hear(asker, message.name, message.values, now, first=first)
        if self._is_busy(asker):
            session.readers[asker] = message

    def pump(self, session: "Session", now: float) -> bool:
        """Send the next packets to the readers of a session; whether there are more."""
        for asker, message in list(session.readers.items()):
            for _ in range(AT_ONCE):
                if self._files.busy(asker) and (payload := self._files.more(asker, now)) is not None:
                    session.answer(message, "FILE_TRANSFER_PROTOCOL", payload=payload)
                if (said := self._logs.more(asker, now)) is not None:
                    session.send(said[0], said[1])
            if not self._is_busy(asker):
                del session.readers[asker]
        return bool(session.readers)

    def forget_silent(self, now: float) -> None:
        """Close what nobody has read for some time."""
        self._files.forget_silent(now)
        self._logs.forget_silent(now)

    def close(self) -> None:
        self._files.close()
        self._logs.close()

    def _is_busy(self, asker: Asker) -> bool:
        return self._files.busy(asker) or self._logs.busy(asker)
