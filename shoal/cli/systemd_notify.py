"""The computer around a run: its service manager, which expects notifications of the run, and its clock."""

import contextlib
import faulthandler
import os
import socket
import sys
import time
from pathlib import Path

from runtime.task import State
from runtime.vehicle import Vehicle

LONGEST_PERIOD = 1.0  # s of real time between two looks
TOLERATED = 60.0  # s that a file may be newer than the present
TROUBLE = (State.ERROR, State.FAILURE)
LONGEST_STATUS = 200  # characters


class SystemdNotifier:
    """Notifies systemd that a run is ready, runs, and stops, and the operators if the computer's clock is wrong.

    Notifications come from the kernel's thread, as any handler: WATCHDOG=1 means that the vehicle really runs. The
    protocol is that of sd_notify(3): datagrams to the socket named in NOTIFY_SOCKET. Without it nothing is sent.
    """

    def __init__(self, vehicle: Vehicle):
        self._vehicle = vehicle
        self._address = _pop_variable("NOTIFY_SOCKET")
        self._socket: socket.socket | None = None
        watchdog = _pop_variable("WATCHDOG_USEC") if _pop_variable("WATCHDOG_PID") in ("", str(os.getpid())) else ""
        self._watchdog = watchdog.isdecimal() and int(watchdog) > 0
        limit = int(watchdog) / 1e6 if self._watchdog else 2.0 * LONGEST_PERIOD
        self._period = min(LONGEST_PERIOD, limit / 3.0) * min(vehicle.kernel.clock.speed, 1e6)
        if self._address:
            with contextlib.suppress(OSError):
                self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
                self._socket.setblocking(False)

    def notify_ready(self) -> None:
        """Report that all tasks have started; not for virtual time."""
        self._check_clock()
        if self._watchdog:  # systemd ends a run that hangs with SIGABRT: have the lines written where it hangs
            with contextlib.suppress(ValueError, OSError, RuntimeError):
                faulthandler.enable(sys.__stderr__ or sys.stderr)
        self._send("READY=1", f"MAINPID={os.getpid()}")
        self._notify_alive()

    def notify_stopping(self) -> None:
        """Report that the tasks are about to stop."""
        self._send("STOPPING=1")

    def _notify_alive(self) -> None:
        self._send(*(["WATCHDOG=1"] if self._watchdog else []), f"STATUS={self._status()}")
        self._vehicle.kernel.after(self._period, self._notify_alive)

    def _status(self) -> str:
        """One line for `systemctl status`."""
        troubled = [e for e in self._vehicle.entities if e.stateful and e.state in TROUBLE]
        words = "; ".join(f"{e.label}: {' '.join(e.description.split())}" for e in troubled)
        return f"{self._vehicle.name}: {words or 'all is well'}"[:LONGEST_STATUS]

    def _send(self, *lines: str) -> None:
        if self._socket is None or not self._address:
            return
        address = f"\0{self._address[1:]}" if self._address.startswith("@") else self._address
        with contextlib.suppress(OSError):  # systemd does not listen or read
            self._socket.sendto("\n".join(lines).encode(errors="replace"), address)

    def _check_clock(self) -> None:
        """Warn of a clock that is behind what this computer has already seen."""
        known = {"Shoal was installed": _changed(Path(__file__))}
        days = self._vehicle.log_root / self._vehicle.name
        with contextlib.suppress(OSError):
            known["the last log"] = max((_changed(day) for day in days.iterdir()), default=0.0)
        what = max(known, key=known.__getitem__)
        if known[what] > time.time() + TOLERATED:
            now, then = (time.strftime("%Y-%m-%d %H:%M", time.gmtime(t)) for t in (time.time(), known[what]))
            self._vehicle.daemon.log.warning(
                f"the computer's clock is not set: it shows {now}, but {what}: {then}; "
                "all times of this run are wrong until the clock is set and the run started again"
            )


def _pop_variable(name: str) -> str:
    """A variable of the environment, which programs that the run starts do not get."""
    return os.environ.pop(name, "")


def _changed(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
