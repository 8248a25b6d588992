"""Serves one folder over FTP, in a thread of its own; the protocol is pyftpdlib's."""

import os
import select
import shutil
import socket
import stat
from collections import Counter
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from tasks.transports.imc_links.port_search import listening_socket

MOST_SESSIONS, MOST_OF_ONE = 12, 8  # in all, and from one address
MOST_ANSWERS, UNREAD = 256, 1 << 14  # answers, and bytes of them in the socket, that a client leaves unread
MOST_IN_TREE = 5000  # files that one answer lists
READ_SIZE = 128  # bytes of commands taken from a session at a time
PAUSE = 0.002  # s between two looks at the sockets: the vehicle's tasks come first
PATIENCE = 0.25  # s that a look waits; `stop` takes so long
TRIES = 5  # ports, from the wanted one on

READ, DELETE = "elr", "elrd"  # pyftpdlib's letters: change folder, list, retrieve; delete


class FTPServer:
    """Any user reads the files in `folder`, and nothing else; with `deletes` files and folders can be removed.

    It opens the first free of a few ports from `port` on. `in_use(path)` is whether a path must not be removed;
    `may_delete(address)` is whether a client there may remove anything. `report(text)` is called with refusals and
    removals; all of them from the thread of `run`.
    Counted: `counts`, by what was done. Raises OSError if no port can be opened.
    """

    def __init__(
        self,
        folder: Path,
        address: str,
        port: int,
        *,
        deletes: bool,
        timeout: float,
        in_use: Callable[[Path], bool],
        may_delete: Callable[[str], bool] = lambda _: True,
        report: Callable[[str], object],
    ):
        self.folder: Path = folder.resolve()
        self.rights = DELETE if deletes else READ
        self.counts: Counter[str] = Counter()
        self.in_use: Callable[[Path], bool] = in_use
        self.may_delete: Callable[[str], bool] = may_delete
        self.report: Callable[[str], object] = report
        self._stop, self._stopped = socket.socketpair()
        self._loop: Any = import_module("pyftpdlib.ioloop").IOLoop()
        self._listener = listening_socket(address, port, TRIES)
        self.port: int = self._listener.getsockname()[1]
        self._acceptor: Any = import_module("pyftpdlib.servers").FTPServer(
            self._listener, _session(self, timeout), ioloop=self._loop
        )
        self.clients: dict[Any, str] = {}  # sessions that are open, the longest idle first, and their addresses

    @property
    def sessions(self) -> int:
        """Number of clients that are connected."""
        return len(self._acceptor.ip_map)

    def make_room(self, address: str) -> bool:
        """End the session that was idle longest if there are too many, in all or from one address."""
        count = Counter(self.clients.values())
        if count[address] < MOST_OF_ONE and len(self.clients) < MOST_SESSIONS:
            return True
        crowded = address if count[address] >= MOST_OF_ONE else count.most_common(1)[0][0]
        idle = [each for each, place in self.clients.items() if place == crowded and each.is_idle()]
        if idle:
            self.counts["idle clients ended"] += 1
            idle[0].close()
        return bool(idle)

    def run(self) -> None:
        """Serve until `stop`; for a thread of its own."""
        try:
            while not self._stops():
                self._loop.loop(timeout=PATIENCE, blocking=False)
        finally:
            self._loop.close()
            self._stopped.close()
            self._stop.close()

    def _stops(self) -> bool:
        """Whether to stop; without clients it waits for one, since each look hinders the vehicle's tasks."""
        if not self.sessions:
            select.select([self._stopped, self._listener], [], [])
        return bool(select.select([self._stopped], [], [], PAUSE)[0])

    def stop(self) -> None:
        """End `run`, and all sessions, from any thread."""
        try:
            self._stop.send(b"\0")
        except OSError:
            pass  # it has ended already


class _Anybody:
    """Lets every user in: the protocol sends passwords in the clear, so they would protect nothing."""

    def __init__(self, folder: Path, rights: str):
        self._folder, self._rights = folder, rights

    def validate_authentication(self, username: str, password: str, handler: object) -> None: ...
    def impersonate_user(self, username: str, password: str) -> None: ...
    def terminate_impersonation(self, username: str) -> None: ...

    def get_home_dir(self, username: str) -> str:
        return str(self._folder)

    def has_perm(self, username: str, perm: str, path: str | None = None) -> bool:
        return perm in self._rights

    def get_perms(self, username: str) -> str:
        return self._rights

    def get_msg_login(self, username: str) -> str:
        return "The logs of this vehicle."

    def get_msg_quit(self, username: str) -> str:
        return "Goodbye."


def _session(server: FTPServer, timeout: float) -> Any:
    """The class of the sessions of a server; here, since pyftpdlib is an extra."""
    filesystems: Any = import_module("pyftpdlib.filesystems")
    handlers: Any = import_module("pyftpdlib.handlers")

    class Folder(filesystems.AbstractedFS):
        """The files of the folder; links that lead out of it are not there, others are what they lead to."""

        def listdir(self, path: str) -> list[str]:
            return sorted(name for name in os.listdir(path) if self.validpath(os.path.join(path, name)))

        def open(self, filename: str, mode: str) -> Any:
            descriptor = os.open(filename, os.O_RDONLY | os.O_NONBLOCK)  # a pipe would keep us waiting
            if not stat.S_ISREG(os.fstat(descriptor).st_mode) or mode != "rb":
                os.close(descriptor)
                raise filesystems.FilesystemError("Not a file")
            return open(descriptor, "rb")

        def lstat(self, path: str) -> os.stat_result:
            return os.stat(path)

        def get_user_by_uid(self, uid: int) -> str:
            return "unknown"

        get_group_by_gid = get_user_by_uid

    class Data(handlers.DTPHandler):
        """A transfer."""

    class Session(handlers.FTPHandler):
        """One client."""

        banner = "Logs of a vehicle, by Shoal."
        authorizer = _Anybody(server.folder, server.rights)
        abstracted_fs = Folder
        dtp_handler = Data
        ac_in_buffer_size = READ_SIZE
        # USPC is DUNE's: free and total bytes of the disk. SITE TREE is ours: MLSD needs a connection for each folder,
        # which takes seconds over a bad radio.
        proto_cmds = handlers.FTPHandler.proto_cmds | {
            "USPC": {"perm": None, "auth": True, "arg": None, "help": "Syntax: USPC (free and total bytes)."},
            "SITE TREE": {"perm": "l", "auth": True, "arg": None, "help": "Syntax: SITE TREE (files of all logs)."},
        }

        def handle(self) -> None:
            if not server.make_room(self.remote_ip):
                self.handle_max_cons()
                return
            server.clients[self] = self.remote_ip
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, UNREAD)
            handlers.FTPHandler.handle(self)

        def close(self) -> None:
            server.clients.pop(self, None)
            handlers.FTPHandler.close(self)

        def is_idle(self) -> bool:
            return self.data_channel is None and self._out_dtp_queue is None

        def pre_process_command(self, line: str, cmd: str, arg: str) -> None:
            if not self.connected:
                return  # what it has sent before it was cut off
            server.clients[self] = server.clients.pop(self, self.remote_ip)
            if len(self.producer_fifo) > MOST_ANSWERS:
                server.counts["cut off"] += 1
                self.close()
                return
            if cmd == "LIST" and arg.startswith("-"):  # options of ls
                arg = arg.partition(" ")[2]
            handlers.FTPHandler.pre_process_command(self, line, cmd, arg)

        def ftp_USPC(self, _: str) -> None:
            usage = shutil.disk_usage(server.folder)
            self.respond(f"258 {usage.free} {usage.total}")

        def ftp_SITE_TREE(self, _: str) -> None:
            if self.producer_fifo:
                self.respond("450 The last answer is not yet sent.")
                return
            try:
                files = list(islice(self.files(), MOST_IN_TREE + 1))
            except OSError as error:
                self.respond(f"550 {error.strerror}.")
                return
            if len(files) > MOST_IN_TREE:
                self.respond("504 There are too many files.")
                return
            self.push("211-\r\n" + "".join(f" {line}" for line in files))
            self.respond("211 That is all.")

        def files(self) -> Iterator[str]:
            """A line for each log folder and each file in it, as of MLSD, with the path in place of the name."""
            for day in self.folders(self.fs.root):
                for log in self.folders(day):
                    yield f"type=dir; {self.fs.fs2ftp(log)}\r\n"
                    names = [name for name in self.fs.listdir(log) if name.isprintable()]
                    facts = self.fs.format_mlsx(log, names, "", ["type", "size", "modify"])
                    for line in map(os.fsdecode, facts):
                        each, _, name = line.partition("; ")
                        yield f"{each}; {self.fs.fs2ftp(log)}/{name}"

        def folders(self, path: str) -> list[str]:
            each = [os.path.join(path, name) for name in self.fs.listdir(path) if name.isprintable()]
            return [folder for folder in each if os.path.isdir(folder)]

        def ftp_SYST(self, _: str) -> None:
            self.respond("215 UNIX Type: L8")

        def ftp_DELE(self, path: str) -> None:
            """Remove a file, or a folder with all that is in it, as DUNE does; never what is being written."""
            name = self.fs.fs2ftp(path)
            if not server.may_delete(self.remote_ip):
                self.respond("550 Your address is not in [General] Consoles.")
                return
            real = Path(path).parent.resolve() / Path(path).name
            if real == server.folder or server.in_use(real):
                self.respond("550 This is being written.")
                return
            try:
                shutil.rmtree(path) if os.path.isdir(path) and not os.path.islink(path) else os.remove(path)
            except OSError as error:
                self.respond(f"550 {error.strerror}.")
            else:
                server.counts["removed"] += 1
                server.report(f"{self.remote_ip} removed {name}")
                self.respond("250 Removed.")

        ftp_RMD = ftp_XRMD = ftp_DELE

        def log_cmd(self, cmd: str, arg: str, respcode: int, respstr: str) -> None:
            if respcode == 550:
                server.counts["rejected"] += 1
                server.report(f"{self.remote_ip} may not {cmd} {self.fs.fs2ftp(arg)}: {respstr}")

        def on_file_sent(self, _: str) -> None:
            server.counts["sent"] += 1

        def on_incomplete_file_sent(self, _: str) -> None:
            server.counts["broken off"] += 1

        def log(self, msg: str, logfun: object = None) -> None: ...
        def logline(self, msg: str, logfun: object = None) -> None: ...
        def logerror(self, msg: str) -> None: ...

        def log_exception(self, instance: object) -> None:
            server.counts["errors"] += 1

    Session.timeout = Data.timeout = timeout
    return Session
