"""Shows the vehicle of a log that is replayed to MAVLink ground stations, as if it were there."""

from pathlib import Path
from typing import cast

import imc
from mavlink import KINDS, load_dialect, statustext
from runtime import State, consume, param, periodic
from tasks.transports.mavlink_protocol.figures import Heard
from tasks.transports.mavlink_protocol.ground import CHANGES, GroundLinks
from tasks.transports.mavlink_protocol.logged import Identity, LoggedSystem, identify
from tasks.transports.mavlink_protocol.named_values import parse_named_value
from tasks.transports.mavlink_protocol.parameters import ParameterTable
from tasks.transports.replay_log import Passed, Player

AS_LOGGED = "as logged"
PLAYER = "Transports.Replay"
MOST_EARLY = 20_000  # messages that wait until the vehicle of a log is known
Told = (
    imc.EntityInfo
    | imc.EntityList
    | imc.EntityState
    | imc.LogBookEntry
    | imc.EstimatedMugState
    | imc.PlanSpecification
    | imc.PlanControl
    | imc.PlanDB
)
"""What is told by a log beside the figures that ground stations see."""


def ignore(message: imc.Message) -> None:
    """A vehicle that is not there gets no requests."""


class MAVLinkReplay(GroundLinks):
    """MAVLink 2 for the vehicle of the log that `Transports.Replay` plays; it takes no orders.

    Stations also see the parameters of the replay, by which they can move it.
    """

    hears_others = True
    vehicle_kind: str = param(
        AS_LOGGED, "", "MAV_TYPE reported to ground stations.", choices=(AS_LOGGED, *KINDS), editable=False
    )
    shown_system: str = param(
        "", "", "Name or id of the system of the log that is shown; empty shows its owner.", editable=False
    )

    def start(self) -> None:
        self._identity: Identity | None = None
        self._path: Path | None = None
        self._turn = 0
        self._early: list[tuple[imc.Message, float]] = []
        player = next((task for task in self.vehicle.tasks if task.name == PLAYER), None)
        if player is None:
            self.set_entity_state(State.ERROR, f"there is no task {PLAYER}")
            return
        self._dialect = load_dialect()  # now, since that takes a while
        self._player = cast(Player, player)
        self._player.follow(self._land)
        self.set_entity_state(State.NORMAL, "no log yet")

    def stop(self) -> None:
        if self._identity is not None:
            self._identity = None
            if self.pump_timer is not None:
                self.pump_timer.cancel()
            super().stop()

    def _land(self, path: Path, passed: Passed) -> None:
        """Show what the log says of the time before a jump; a log that is new has another vehicle."""
        self._turn += 1
        turn = self._turn
        self._early = []
        if path == self._path and self._identity is not None:
            self._show(passed)
            return

        def begin(identity: Identity | str) -> None:
            if turn == self._turn:
                self._begin(path, identity, passed)

        self._path = path
        self.stop()
        self.offload(identify, path, self.shown_system, then=begin)

    def _begin(self, path: Path, identity: Identity | str, passed: Passed) -> None:
        if isinstance(identity, str):
            self.log.error(identity)
            self.set_entity_state(State.ERROR, identity)
            return
        self._identity = identity
        super().start()
        self.log.info(f"showing {identity.name} as MAVLink system {self.autopilot.system}")
        self._show(passed)

    def make_autopilot(self) -> LoggedSystem:
        identity = self._identity
        assert identity is not None
        kind = identity.kind if self.vehicle_kind == AS_LOGGED else self.vehicle_kind
        return LoggedSystem(
            self._dialect,
            elapsed=lambda: self._player.elapsed,
            now=lambda: self.now,
            name=identity.name,
            system=self.system_id or identity.system,
            kind=KINDS[kind],
            boot=self.vehicle.start_time,
            undulation=self.geoid_undulation or identity.undulation,
            rates=lambda: self.rates,
            parameters=ParameterTable(self.vehicle.tasks),
            imc_id=identity.imc_id,
            publish=ignore,
            set_parameter=self.ask_for,
            say=self.say,
            speed=lambda: self.hold_speed,
            reach=self.reach,
            named_values=[parse_named_value(word) for word in self.named_values],
        )

    def _show(self, passed: Passed) -> None:
        system = self.logged
        system.restart()
        for due in passed.packets:
            message = imc.decode(due.packet)
            if not isinstance(message, imc.LogBookEntry | imc.EstimatedMugState):
                self._take(message, due.elapsed, passed.time - due.elapsed)
        early, self._early = self._early, []
        for message, elapsed in early:
            self._take(message, elapsed, 0.0)
        self.show_changes()
        self.pump()

    @property
    def logged(self) -> LoggedSystem:
        assert isinstance(self.autopilot, LoggedSystem)
        return self.autopilot

    @consume(others=True)
    def note(self, message: Heard | Told) -> None:
        """Take what the log says."""
        if self._identity is None:
            if len(self._early) < MOST_EARLY and self._path is not None:
                self._early.append((message, self._player.elapsed))
            return
        self._take(message, self._player.elapsed, 0.0)
        if isinstance(message, CHANGES):
            self.show_changes()

    def _take(self, message: imc.Message, elapsed: float, age: float) -> None:
        """Take a message, `age` s after it was due at a time of the log."""
        system = self.logged
        if message.src != system.imc_id:
            if isinstance(message, imc.PlanDB | imc.PlanControl) and message.dst == system.imc_id:
                system.learn(message)
            return
        system.learn(message, message.timestamp)
        if isinstance(message, imc.LogBookEntry):
            self.tell(message)
        elif isinstance(message, imc.EstimatedMugState):
            self.gallery.hear(message, system.label(message.src_ent), self.now)
        else:
            system.hear(message.replace(timestamp=self.now - age), system.label(message.src_ent), elapsed)

    @periodic(1.0)
    def look_after_links(self) -> None:
        if self._identity is not None:
            super().look_after_links()

    def pump(self) -> None:
        if self._identity is not None:
            super().pump()

    def show_changed(self, reply: imc.EntityParameters) -> None:
        if self._identity is not None:
            super().show_changed(reply)

    @consume(others=True)
    def note_abort(self, abort: imc.Abort) -> None:
        """Take an Abort of the log."""
        if self._identity is not None and self.logged.imc_id in (abort.src, abort.dst):
            self.autopilot.hear(abort, "", self._player.elapsed)
            self.say(statustext.EMERGENCY, "Abort")

    def say(self, severity: int, words: str) -> None:
        if self._identity is not None:
            super().say(severity, words)
