"""The mission protocol: uploads, downloads and their answers, for several ground stations at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from mavlink import ReceivedMessage, statustext
from mavlink.missions import MOST_ITEMS, BadItem, Item, MissionResult, MissionType, first_item_seq
from mavlink.vehicle.mission.plan_client import PlanReply
from mavlink.vehicle.mission.store import MissionStore
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session

RETRIES = 5
REMEMBERED = 10.0  # s in which the last item again means that the answer was lost; stations try for 7.5 s
ECHOES, ECHO_PERIOD = 2, 0.5  # s
Asker = tuple[int, int]
STORED = (MissionType.MISSION, MissionType.FENCE)


@dataclass(slots=True)
class Upload:
    """Items on their way from a station: `items` has those before `end` that are known already or have come."""

    session: Session
    message: ReceivedMessage
    kind: int
    items: list[Item]
    begin: int
    end: int
    due: float
    tries: int = 0
    corrected: int = -1
    storing: bool = False
    tail: list[Item] = field(default_factory=list[Item])

    @property
    def uploader_ids(self) -> Asker:
        return self.message.system, self.message.component


@dataclass(frozen=True, slots=True)
class _Done:
    """An upload that has ended: who sent it, its last item, and the answer."""

    asker: Asker
    last: int
    result: int
    id: int
    at: float


@dataclass(slots=True)
class _Echo:
    """An answer that is sent again, since it may have been lost."""

    upload: Upload
    result: int
    id: int
    due: float
    left: int = ECHOES


class MissionTransfer(MavlinkService):
    """The uploads and downloads of all stations; only one may upload a kind of items at a time."""

    def __init__(self, mission: MissionStore) -> None:
        self.mission = mission
        self._uploads: dict[int, Upload] = {}
        self._done: dict[int, _Done] = {}
        self._echo: _Echo | None = None
        handlers: Mapping[str, Handler] = {
            "MISSION_REQUEST_LIST": self._list,
            "MISSION_REQUEST": self._request,
            "MISSION_REQUEST_INT": self._request,
            "MISSION_COUNT": self._count,
            "MISSION_WRITE_PARTIAL_LIST": self._write_part,
            "MISSION_ITEM": self._item,
            "MISSION_ITEM_INT": self._item,
            "MISSION_ACK": self._acknowledged,
            "MISSION_CLEAR_ALL": self._clear,
            "MISSION_SET_CURRENT": self._set_current,
        }
        self._handlers = {name: partial(self._serve, handler) for name, handler in handlers.items()}

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return self._handlers

    def poll(self, now: float) -> None:
        """Ask again for items that have not come, and give up at last; repeat an answer that may have been lost."""
        self.mission.poll(now)
        echo = self._echo
        if echo is not None and now >= echo.due:
            acknowledge(echo.upload.session, echo.upload.message, echo.result, echo.id)
            echo.due, echo.left = now + ECHO_PERIOD * echo.upload.session.speed, echo.left - 1
            self._echo = echo if echo.left else None
        for upload in list(self._uploads.values()):
            if upload.storing or now < upload.due:
                continue
            upload.tries += 1
            if upload.tries > RETRIES:
                self._finish(upload, MissionResult.OPERATION_CANCELLED, now)
                upload.session.send_statustext(
                    statustext.WARNING, f"Mission upload ended: item {len(upload.items)} did not come", now
                )
            else:
                self._ask(upload, now)

    @property
    def next_deadline(self) -> float | None:
        """Time at which an item or an echo is due, in s since 1970."""
        echo = [] if self._echo is None else [self._echo.due]
        fence = [] if self.mission.next_deadline is None else [self.mission.next_deadline]
        return min(
            [*echo, *fence, *(upload.due for upload in self._uploads.values() if not upload.storing)], default=None
        )

    def items(self, kind: int, session: Session) -> Sequence[Item]:
        if kind == MissionType.MISSION:
            return self.mission.items(session.flavor)
        return self.mission.fence() if kind == MissionType.FENCE else ()

    def _serve(self, handler: Handler, session: Session, message: ReceivedMessage, now: float) -> None:
        """A station that continues has its answer, and could take an echo for the next one."""
        echo = self._echo
        if echo is not None and (echo.upload.session, echo.upload.uploader_ids) == (
            session,
            (message.system, message.component),
        ):
            self._echo = None
        handler(session, message, now)

    def _list(self, session: Session, message: ReceivedMessage, now: float) -> None:
        kind = message.values["mission_type"]
        if kind not in (*STORED, MissionType.RALLY):
            acknowledge(session, message, MissionResult.UNSUPPORTED)
            return
        count = len(self.items(kind, session))
        id = self.mission.id(session.flavor) if kind == MissionType.MISSION else 0
        session.reply(message, "MISSION_COUNT", count=count, mission_type=kind, opaque_id=id)

    def _request(self, session: Session, message: ReceivedMessage, now: float) -> None:
        kind: int = message.values["mission_type"]
        seq: int = message.values["seq"]
        items = self.items(kind, session)
        if seq >= len(items):
            acknowledge(session, message, MissionResult.INVALID_SEQUENCE)
            return
        item = items[seq]
        if message.name == "MISSION_REQUEST":
            session.reply(message, "MISSION_ITEM", **item.legacy_fields(seq))
        else:
            session.reply(message, "MISSION_ITEM_INT", **item.fields(seq))

    def _count(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Begin an upload of a station; the same one may begin again at any time."""
        kind, count = message.values["mission_type"], message.values["count"]
        if kind not in STORED:
            empty = kind == MissionType.RALLY and count == 0
            acknowledge(session, message, MissionResult.ACCEPTED if empty else MissionResult.UNSUPPORTED)
        elif self._is_busy(session, message, kind):
            acknowledge(session, message, MissionResult.DENIED)
        elif count > MOST_ITEMS:
            acknowledge(session, message, MissionResult.NO_SPACE)
            session.send_statustext(statustext.WARNING, f"A mission has at most {MOST_ITEMS} items, not {count}", now)
        else:
            self._begin(Upload(session, message, kind, [], 0, count, now), now)

    def _write_part(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """A station replaces some of the items."""
        kind, begin, end = (message.values[name] for name in ("mission_type", "start_index", "end_index"))
        items = list(self.items(kind, session))
        end = len(items) - 1 if end == -1 else end
        if kind not in STORED:
            acknowledge(session, message, MissionResult.UNSUPPORTED)
        elif self._is_busy(session, message, kind):
            acknowledge(session, message, MissionResult.DENIED)
        elif not 0 <= begin <= end < len(items):
            acknowledge(session, message, MissionResult.INVALID_SEQUENCE)
        else:
            upload = Upload(session, message, kind, items[:begin], begin, end + 1, now, tail=items[end + 1 :])
            self._begin(upload, now)

    def _item(self, session: Session, message: ReceivedMessage, now: float) -> None:
        kind, seq, asker = message.values["mission_type"], message.values["seq"], (message.system, message.component)
        upload = self._uploads.get(kind)
        if upload is None or upload.session is not session or upload.uploader_ids != asker:
            done = self._done.get(kind)
            if done is not None and done.asker == asker and now - done.at < REMEMBERED * session.speed:
                if seq == done.last:
                    acknowledge(session, message, done.result, done.id)
                return  # another one was overtaken: any other acknowledgment would end what the station does now
            if upload is None:
                acknowledge(session, message, MissionResult.INVALID_SEQUENCE)
            return
        if upload.storing or seq < len(upload.items):
            return  # again: the next one has been asked for
        if seq > len(upload.items):
            # Once: who always sends another one must come to an end.
            if upload.corrected < len(upload.items):
                upload.corrected = len(upload.items)
                self._ask(upload, now)
            return
        try:
            legacy = message.name == "MISSION_ITEM"
            upload.items.append(Item.of_legacy(message.values) if legacy else Item.of(message.values))
        except BadItem as bad:
            self._refuse(upload, bad, now)
            return
        upload.tries = 0
        self._continue(upload, now)

    def _acknowledged(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """A station that sends an error ends its upload; acknowledgments of downloads need no answer."""
        upload = self._uploads.get(message.values["mission_type"])
        asker = message.system, message.component
        mine = upload is not None and upload.session is session and upload.uploader_ids == asker and not upload.storing
        if mine and message.values["type"] != MissionResult.ACCEPTED:
            del self._uploads[message.values["mission_type"]]

    def _clear(self, session: Session, message: ReceivedMessage, now: float) -> None:
        kind = message.values["mission_type"]
        if kind not in (*STORED, MissionType.RALLY, MissionType.ALL):
            acknowledge(session, message, MissionResult.UNSUPPORTED)
            return
        if any(kind in (upload.kind, MissionType.ALL) for upload in self._uploads.values()):
            acknowledge(session, message, MissionResult.DENIED)
            return

        def clear_mission(outcome: PlanReply) -> None:
            if not outcome.done:
                acknowledge(session, message, MissionResult.ERROR)
            elif kind in (MissionType.MISSION, MissionType.ALL):
                self.mission.clear(lambda _: acknowledge(session, message, MissionResult.ACCEPTED), now)
            else:
                acknowledge(session, message, MissionResult.ACCEPTED)

        if kind in (MissionType.FENCE, MissionType.ALL) and self.mission.fence():
            self.mission.put_fence((), clear_mission, now)
        else:
            clear_mission(PlanReply(True))

    def _set_current(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """The older form of MAV_CMD_DO_SET_MISSION_CURRENT, which has no acknowledgment."""
        seq = message.values["seq"]

        def judge(outcome: PlanReply) -> None:
            if not outcome.done:
                session.send_statustext(statustext.WARNING, f"Cannot continue at item {seq}: {outcome.reason}", now)

        if not self.mission.set_current(seq_to_item_number(seq, session), judge, now):
            session.send_statustext(statustext.WARNING, f"No item from {seq} on moves the vehicle", now)
        session.build_and_send("MISSION_CURRENT", now)

    def _is_busy(self, session: Session, message: ReceivedMessage, kind: int) -> bool:
        upload = self._uploads.get(kind)
        if upload is None:
            return False
        return (
            upload.storing
            or upload.session is not session
            or upload.uploader_ids != (message.system, message.component)
        )

    def _begin(self, upload: Upload, now: float) -> None:
        self._done.pop(upload.kind, None)
        self._uploads[upload.kind] = upload
        self._continue(upload, now)

    def _continue(self, upload: Upload, now: float) -> None:
        """Ask for the next item, or take the whole."""
        if len(upload.items) < upload.end:
            self._ask(upload, now)
            return
        upload.storing = True
        items = upload.items + upload.tail
        try:
            if upload.kind == MissionType.FENCE:
                self.mission.put_fence(items, lambda done: self._stored_fence(upload, done, now), now)
            else:
                self.mission.put_items(items, upload.session.flavor, lambda done: self._stored(upload, done, now), now)
        except BadItem as bad:
            self._refuse(upload, bad, now)

    def _stored_fence(self, upload: Upload, outcome: PlanReply, now: float) -> None:
        self._finish(upload, MissionResult.ACCEPTED if outcome.done else MissionResult.ERROR, now)
        if not outcome.done:
            upload.session.send_statustext(statustext.WARNING, f"Fence rejected: {outcome.reason}", now)

    def _stored(self, upload: Upload, outcome: PlanReply, now: float) -> None:
        self._finish(upload, MissionResult.ACCEPTED if outcome.done else MissionResult.ERROR, now)
        say = partial(upload.session.send_statustext, statustext.WARNING, now=now)
        if not outcome.done:
            say(f"Mission rejected: {outcome.reason}")
        elif self.mission.flies_replaced_mission:
            say("The vehicle continues the mission before this one until it is ordered to start this one")

        def judge(checked: PlanReply) -> None:
            if not checked.done:
                say(f"The mission is stored, but cannot be started now: {checked.reason}")

        if outcome.done:
            self.mission.request_start_check(judge, now)

    def _refuse(self, upload: Upload, bad: BadItem, now: float) -> None:
        self._finish(upload, bad.result, now)
        upload.session.send_statustext(statustext.WARNING, f"Mission rejected: {bad}", now)

    def _finish(self, upload: Upload, result: int, now: float) -> None:
        if self._uploads.get(upload.kind) is not upload:
            return
        del self._uploads[upload.kind]
        stored = result == MissionResult.ACCEPTED and upload.kind == MissionType.MISSION
        id = self.mission.id(upload.session.flavor) if stored else 0
        self._done[upload.kind] = _Done(upload.uploader_ids, upload.end - 1, result, id, now)
        acknowledge(upload.session, upload.message, result, id)
        # MAVSDK does not repeat the last item when the answer is lost; programs that read all answers would mistake
        # an echo for the answer to their next upload, so only a line that loses frames gets it, and no refusal.
        if stored and upload.session.received.has_losses(*upload.uploader_ids):
            self._echo = _Echo(upload, result, id, now + ECHO_PERIOD * upload.session.speed)

    def _ask(self, upload: Upload, now: float) -> None:
        upload.due = now + upload.session.retry_period
        seq = len(upload.items)
        upload.session.reply(upload.message, "MISSION_REQUEST_INT", seq=seq, mission_type=upload.kind)


def seq_to_item_number(seq: int, session: Session) -> int:
    """The number of an item without home, which stands for the first item: a restart."""
    return max(0, seq - first_item_seq(session.flavor)) if seq >= 0 else seq


def acknowledge(session: Session, message: ReceivedMessage, result: int, id: int = 0) -> None:
    """Send MISSION_ACK."""
    kind = message.values["mission_type"]
    session.reply(message, "MISSION_ACK", type=result, mission_type=kind, opaque_id=id)
