"""Lets consoles download logs over FTP."""

from pathlib import Path

from imc.console_acl import ConsoleAcl
from imc.discovery import Service
from runtime import State, Task, param, periodic
from runtime.profile import listed_consoles
from support.log_limit import ReportLimit
from tasks.transports.ftp_server import FTPServer
from tasks.transports.imc_links.port_search import OpenedServer, start_server
from tasks.transports.imc_links.sockets import listen_address, listen_address_param

REPORT_PERIOD = 10.0  # s between two entries about refusals
MOST_TEXTS = 3
LONGEST_TEXT = 200  # characters of a client's text in the log book


class FTP(Task):
    """Serves the vehicle's log folder over FTP, to be read by anybody who reaches the address.

    Nothing can be written, and nothing outside the folder be read. With Allow Deletion, logs can be removed, but not
    the one that is being written; if [General] Consoles lists any, only from an address in it. It runs in a thread of
    its own, so that a slow disk or client delays no task.
    """

    external = True
    requires = "ftp"
    optional = True

    address: str = listen_address_param()
    control_port: int = param(
        30021,
        "1",
        "Port to listen at; if it is taken, one of the next four, else any. 0 takes any.",
        minimum=0,
        maximum=65535,
        editable=False,
    )
    session_timeout: float = param(120.0, "s", "Idle time that ends a session.", minimum=1, editable=False)
    allow_deletion: bool = param(False, "", "Let clients remove logs.", editable=False)

    def configure(self) -> None:
        self.place: str = listen_address(self, self.address)
        self.commanders: ConsoleAcl = listed_consoles(self)

    def start(self) -> None:
        self._server: FTPServer | None = None
        self._texts: list[str] = []
        self._report_limit, self._left_out = ReportLimit(REPORT_PERIOD), 0
        start_server(self, self._open, self.report)

    def stop(self) -> None:
        if self._server is not None:
            self._server.stop()

    @property
    def port(self) -> int:
        """The port that is open; 0 if none is."""
        return self._server.port if self._server is not None else 0

    @periodic(1.0)
    def report(self) -> None:
        if self._server is None:
            return
        counts = ", ".join(f"{number} {what}" for what, number in sorted(self._server.counts.copy().items()))
        figures = f"port {self.port}: {self._server.sessions} clients" + (f"; files: {counts}" if counts else "")
        self.set_entity_state(State.NORMAL, figures)
        if self._texts and self._report_limit.is_due(now=self.now):
            rest = f"; and {self._left_out} more" if self._left_out else ""
            self.log.warning("; ".join(self._texts) + rest)
            self._texts, self._left_out = [], 0

    def _open(self) -> OpenedServer:
        folder = self.vehicle.log_root / self.system_name
        folder.mkdir(parents=True, exist_ok=True)
        self._server = FTPServer(
            folder,
            self.place,
            self.control_port,
            deletes=self.allow_deletion,
            timeout=self.session_timeout,
            in_use=self._in_use,
            may_delete=self.commanders.allows_address,
            report=lambda text: self.vehicle.kernel.post(self._note, text),
        )
        may = "read and remove" if self.allow_deletion and self.commanders.is_open else "read"
        risk = f"anyone who reaches it can {may} the logs"
        return OpenedServer(self._server.run, Service("ftp", self.place, self.port), self.control_port, risk)

    def _note(self, text: str) -> None:
        """Keep a few texts about what clients did, for the log book."""
        if len(self._texts) < MOST_TEXTS:
            self._texts.append(text[:LONGEST_TEXT])
        else:
            self._left_out += 1

    def _in_use(self, path: Path) -> bool:
        """Whether a path is, contains, or is part of the log that is being written; called from the server's thread."""
        log = self.vehicle.log_folder
        return log is not None and (log.resolve().is_relative_to(path) or path.is_relative_to(log.resolve()))
