"""Shows the vehicle of a log that is replayed to MAVLink ground stations, as if it were there."""

import math
from pathlib import Path
from typing import cast

import imc
from mavlink import KINDS, load_dialect, statustext
from mavlink.vehicle import CHANGES, ShownMessages, VehicleEquipment, VehicleIdentity
from runtime import State, consume, param, periodic
from tasks.transports.mavlink_links.disk_usage_and_thumbnails import DiskPictures
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tasks.transports.mavlink_links.ground_links import GroundLinksTask
from tasks.transports.mavlink_links.logged_vehicle import (
    LoggedEndpoint,
    LoggedIdentity,
    LoggedVehicle,
    identify_log_owner,
)
from tasks.transports.mavlink_links.parameters_and_cameras import task_parameters
from tasks.transports.replayed_log import LogPlayer, SkippedPackets

AS_LOGGED = "as logged"
PLAYER = "Transports.Replay"
MOST_EARLY = 20_000  # messages that wait until the vehicle of a log is known
VehicleReports = (
    imc.EntityInfo
    | imc.EntityList
    | imc.EntityState
    | imc.LogBookEntry
    | imc.EstimatedMugState
    | imc.PlanSpecification
    | imc.PlanControl
    | imc.PlanDB
)
"""The content of a log beside the figures that ground stations see."""


class LoggedPort:
    """The vehicle of a log, which is not there and gets no requests; parameters are those of the replay."""

    def __init__(self, imc_id: int, task: GroundLinksTask) -> None:
        self.imc_id = imc_id
        self._task = task

    def publish(self, message: imc.Message) -> None:
        pass

    def set_parameter(self, entity: str, name: str, text: str) -> None:
        self._task.set_parameter(entity, name, text)

    def age(self, time: float) -> float:
        return self._task.age(time)

    def profile_limit(self, option: str) -> float:
        return math.inf


class MAVLinkReplay(GroundLinksTask):
    """MAVLink 2 for the vehicle of the log that `Transports.Replay` plays; it takes no orders.

    Stations also see the parameters of the replay, by which they can move it.
    """

    receives_others = True
    vehicle_kind: str = param(
        AS_LOGGED, "", "MAV_TYPE reported to ground stations.", choices=(AS_LOGGED, *KINDS), editable=False
    )
    shown_system: str = param(
        "", "", "Name or id of the system of the log that is shown; empty shows its owner.", editable=False
    )

    def start(self) -> None:
        self._identity: LoggedIdentity | None = None
        self._path: Path | None = None
        self._turn = 0
        self._early: list[tuple[imc.Message, float]] = []
        player = next((task for task in self.vehicle.tasks if task.name == PLAYER), None)
        if player is None:
            self.set_entity_state(State.ERROR, f"there is no task {PLAYER}")
            return
        self._dialect = load_dialect()  # now, since that takes a while
        self._player = cast(LogPlayer, player)
        self._player.add_jump_listener(self._land)
        self.set_entity_state(State.NORMAL, "no log yet")

    def stop(self) -> None:
        if self._identity is not None:
            self._identity = None
            if self.poll_timer is not None:
                self.poll_timer.cancel()
            super().stop()

    def _land(self, path: Path, passed: SkippedPackets) -> None:
        """Show the content of the log before a jump; a log that is new has another vehicle."""
        self._turn += 1
        turn = self._turn
        self._early = []
        if path == self._path and self._identity is not None:
            self._show(passed)
            return

        def begin(identity: LoggedIdentity | str) -> None:
            if turn == self._turn:
                self._begin(path, identity, passed)

        self._path = path
        self.stop()
        self.offload(identify_log_owner, path, self.shown_system, then=begin)

    def _begin(self, path: Path, identity: LoggedIdentity | str, passed: SkippedPackets) -> None:
        if isinstance(identity, str):
            self.log.error(identity)
            self.set_entity_state(State.ERROR, identity)
            return
        self._identity = identity
        super().start()
        self.log.info(f"showing {identity.name} as MAVLink system {self.endpoint.model.system}")
        self._show(passed)

    def make_endpoint(self) -> LoggedEndpoint:
        identity = self._identity
        assert identity is not None
        kind = identity.kind if self.vehicle_kind == AS_LOGGED else self.vehicle_kind
        about = VehicleIdentity(
            identity.name,
            self.system_id or identity.system,
            KINDS[kind],
            self.vehicle.start_time,
            self.geoid_undulation or identity.undulation,
        )
        port = LoggedPort(identity.imc_id, self)
        model = LoggedVehicle(
            about,
            port,
            self,
            elapsed=lambda: self._player.elapsed,
            now=lambda: self.now,
            enumerations=self._dialect.enumerations,
        )
        equipment = VehicleEquipment(
            task_parameters(self.vehicle.tasks),
            DiskFolders({}),
            DiskPictures(self.vehicle.log_root, self.offload),
            named_values=self.parse_named_values(),
        )
        return LoggedEndpoint(self._dialect, model, port, equipment, self.log.warning)

    def _show(self, passed: SkippedPackets) -> None:
        self.logged_endpoint.reset()
        for due in passed.packets:
            message = imc.decode(due.packet)
            if not isinstance(message, imc.LogBookEntry | imc.EstimatedMugState):
                self._take(message, due.elapsed, passed.time - due.elapsed)
        early, self._early = self._early, []
        for message, elapsed in early:
            self._take(message, elapsed, 0.0)
        self.logged_endpoint.send_changes(self.now)
        self.send_due_messages()

    @property
    def logged_endpoint(self) -> LoggedEndpoint:
        assert isinstance(self.endpoint, LoggedEndpoint)
        return self.endpoint

    @consume(others=True)
    def show_state(self, message: ShownMessages | VehicleReports) -> None:
        """Take a message of the log."""
        if self._identity is None:
            if len(self._early) < MOST_EARLY and self._path is not None:
                self._early.append((message, self._player.elapsed))
            return
        self._take(message, self._player.elapsed, 0.0)
        if isinstance(message, CHANGES):
            self.logged_endpoint.send_changes(self.now)

    def _take(self, message: imc.Message, elapsed: float, age: float) -> None:
        """Take a message, `age` s after it was due at a time of the log."""
        logged, identity = self.logged_endpoint, self._identity
        assert identity is not None
        if message.src != identity.imc_id:
            if isinstance(message, imc.PlanDB | imc.PlanControl) and message.dst == identity.imc_id:
                logged.learn_entities_and_plans(message)
            return
        logged.learn_entities_and_plans(message, message.timestamp)
        label = logged.model.label(message.src_ent)
        if isinstance(message, imc.LogBookEntry | imc.EstimatedMugState):
            logged.receive_imc_message(message, label, self.now)
        else:
            logged.update_state(message.replace(timestamp=self.now - age), label, elapsed)

    @periodic(1.0)
    def maintain_links(self) -> None:
        if self._identity is not None:
            super().maintain_links()

    def send_due_messages(self) -> None:
        if self._identity is not None:
            super().send_due_messages()

    @consume
    def show_event(self, message: imc.LogBookEntry | imc.Event | imc.EstimatedMugState | imc.EntityParameters) -> None:
        if self._identity is not None:
            super().show_event(message)

    @consume(others=True)
    def show_abort(self, abort: imc.Abort) -> None:
        """Take an Abort of the log."""
        if self._identity is not None and self._identity.imc_id in (abort.src, abort.dst):
            self.logged_endpoint.update_state(abort, "", self._player.elapsed)
            self.logged_endpoint.send_statustext(statustext.EMERGENCY, "Abort", self.now)
