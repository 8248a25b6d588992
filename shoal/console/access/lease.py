"""Leases of vehicles: one session at a time commands each, and all others see which."""

import time
from collections.abc import Callable
from dataclasses import dataclass

LEASE_TIMEOUT = 30.0  # s without an open page of the holder, or from a request to its effect


class LeaseError(Exception):
    """An order of a session that does not hold the lease; the text is for its user."""


@dataclass
class _Lease:
    holder: int
    user: str
    seen: float
    asked_by: tuple[int, str] | None = None
    asked_at: float = 0.0


class Leases:
    """The lease of each vehicle, by its name. Sessions are known by their numbers, people by their names.

    A lease that nobody holds goes to whoever takes it, or commands first. A holder whose pages are closed loses it
    after 30 s. Who wants that of another asks: it passes at once if the holder hands it over, and after 30 s unless the
    holder keeps it. `report(vehicle, text)` gets each change, for the log book. `clock` returns seconds.
    """

    def __init__(self, report: Callable[[str, str], object], clock: Callable[[], float] = time.monotonic) -> None:
        self._report, self._clock = report, clock
        self._leases: dict[str, _Lease] = {}

    def see(self, session: int) -> None:
        """Note that a page of a session is open."""
        now = self._clock()
        for lease in self._leases.values():
            if lease.holder == session:
                lease.seen = now

    def require(self, vehicle: str, session: int, user: str) -> None:
        """Take the lease for an order if it is free. Raises LeaseError if another session holds it."""
        lease = self._current(vehicle)
        if lease is None:
            self._give(vehicle, session, user)
        elif lease.holder == session:
            lease.seen = self._clock()
        else:
            raise LeaseError(f"{lease.user} commands this vehicle: take the lease first")

    def take(self, vehicle: str, session: int, user: str) -> str:
        """Take a free lease, or ask for that of another; returns a sentence for the user."""
        lease = self._current(vehicle)
        if lease is None or lease.holder == session:
            self.require(vehicle, session, user)
            return "you command this vehicle"
        if lease.asked_by is not None and lease.asked_by[0] != session:
            raise LeaseError(f"{lease.asked_by[1]} has asked for it before you")
        if lease.asked_by is None:
            lease.asked_by, lease.asked_at = (session, user), self._clock()
            self._report(vehicle, f"{user} asks {lease.user} for the lease")
        return f"{lease.user} has been asked: it is yours in {self._left(lease):.0f} s, unless {lease.user} keeps it"

    def hand_over(self, vehicle: str, session: int) -> str:
        """Give a lease to who has asked for it, or up. Raises LeaseError if another session holds it."""
        lease = self._held(vehicle, session)
        if lease.asked_by is None:
            del self._leases[vehicle]
            self._report(vehicle, f"{lease.user} gives up the lease")
            return "nobody commands this vehicle now"
        self._give(vehicle, *lease.asked_by)
        return f"{lease.asked_by[1]} commands this vehicle now"

    def leave(self, session: int) -> None:
        """Hand over all leases that a session, which has ended, still has."""
        for vehicle in list(self._leases):
            lease = self._current(vehicle)
            if lease is not None and lease.holder == session:
                self.hand_over(vehicle, session)

    def keep(self, vehicle: str, session: int) -> str:
        """Reject the request of another. Raises LeaseError if another session holds it."""
        lease = self._held(vehicle, session)
        if lease.asked_by is not None:
            self._report(vehicle, f"{lease.user} keeps the lease that {lease.asked_by[1]} asked for")
        lease.asked_by = None
        return "you command this vehicle"

    def view(self) -> dict[str, dict[str, object]]:
        """Leases by vehicle: `session` and `user` that command, and `asked`, `by`, `left` (s) if another has asked."""
        found: dict[str, dict[str, object]] = {}
        for vehicle in list(self._leases):
            lease = self._current(vehicle)
            if lease is None:
                continue
            found[vehicle] = {"session": lease.holder, "user": lease.user}
            if lease.asked_by is not None:
                found[vehicle] |= {
                    "by": lease.asked_by[0],
                    "asked": lease.asked_by[1],
                    "left": round(self._left(lease)),
                }
        return found

    def _left(self, lease: _Lease) -> float:
        return max(0.0, lease.asked_at + LEASE_TIMEOUT - self._clock())

    def _held(self, vehicle: str, session: int) -> _Lease:
        lease = self._current(vehicle)
        if lease is None or lease.holder != session:
            raise LeaseError(f"{lease.user if lease else 'nobody'} commands this vehicle, not you")
        return lease

    def _give(self, vehicle: str, session: int, user: str) -> None:
        self._leases[vehicle] = _Lease(session, user, self._clock())
        self._report(vehicle, f"{user} takes the lease")

    def _current(self, vehicle: str) -> _Lease | None:
        """The lease that is held now: of a holder that is there, after requests whose time is over."""
        lease, now = self._leases.get(vehicle), self._clock()
        if lease is not None and lease.asked_by is not None and now - lease.asked_at >= LEASE_TIMEOUT:
            self._give(vehicle, *lease.asked_by)
            lease = self._leases[vehicle]
        if lease is not None and now - lease.seen >= LEASE_TIMEOUT:
            del self._leases[vehicle]
            self._report(vehicle, f"the lease of {lease.user} ends: its pages are closed")
            return None
        return lease
