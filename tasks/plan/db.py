"""The plan database."""

import sqlite3
from collections import deque
from pathlib import Path
from typing import ClassVar

import imc
from imc.reserved_ids import BROADCAST, UNKNOWN_SYSTEM
from runtime import State, Task, consume, param
from runtime.snapshot import SnapshotError
from support.log_limit import LogLimit
from support.token_bucket import TokenBucket
from tasks.plan.duplicate_requests import DuplicateRequests
from tasks.plan.replies import truncate_reply
from tasks.plan.store import WAIT, PlanChange, PlanRow, PlanStore, StoreFullError, describe_database_error

Op = imc.PlanDB.Op
Type = imc.PlanDB.Type
UNDEFINED = "undefined plan"
MOST_DAMAGED = 10  # files that are kept
STATE_PERIOD = 1.0  # s between two states for all, however fast plans change
RETRY_PERIOD = 10.0  # s between two attempts to use a file that could not be used
CHANGES, AT_ONCE = 10.0, 4.0  # per second, at once: the disk has to confirm each in a file, which takes 20 to 200 ms
MOST_WAITING = 100  # requests, of 64 kB at most each
MOST_OF_ONE = 50  # of one system
CHANGING = (Op.SET, Op.DEL, Op.CLEAR)
TOO_MANY = "too many requests wait for the disk: ask again later"


class DB(Task):
    """Stores plans by id and publishes their digests, so that a console can compare them with its own.

    They are in `Plan.db` in the vehicle's state folder; on a virtual clock, where nothing may come from an earlier run,
    in memory. A file that is damaged is renamed, and its readable plans are kept; where no file can be used, plans are
    kept in memory until it can: then they replace those with the same ids.
    """

    storage: str = param(
        "Automatic",
        "",
        "Storage of plans: in the file, in memory, or in memory only on a virtual clock.",
        choices=("Automatic", "File", "Memory"),
        editable=False,
    )

    transient: ClassVar[tuple[str, ...]] = ("_store", "_current")

    def start(self) -> None:
        self._reply_to_boot(Type.IN_PROGRESS, "initializing")
        trouble = ""
        self._copies, self._copies_of_starts = DuplicateRequests(self.system), DuplicateRequests(self.system)
        self._refusals = LogLimit("more requests are rejected")
        self._pace = TokenBucket(CHANGES, AT_ONCE)
        self._waiting: deque[imc.PlanDB | imc.PlanControl] = deque()
        self._unchecked: dict[tuple[int, ...], imc.PlanControl] = {}  # until the plan engine answers
        self._current: imc.PlanDBState | None = None
        self._published, self._is_due = -STATE_PERIOD, False
        try:
            self._store = self._open()
        except (sqlite3.Error, OSError) as error:
            trouble = f"plans are kept in memory only: {describe_database_error(error, self._path)}"
            self.log.error(trouble)
            self._store = PlanStore(None)
            self.after(RETRY_PERIOD, self._retry)
        self.set_entity_state(State.FAULT if trouble else State.NORMAL, trouble or "active")
        self._reply_to_boot(Type.SUCCESS, "initialization complete")
        self._publish_database_state()

    def before_snapshot(self) -> None:
        if not self._in_memory:
            raise SnapshotError(f"{self.name} keeps its plans in a file, which cannot be saved: set Storage = Memory")
        self._rows = self._store.rows()

    def after_restore(self) -> None:
        self._store = PlanStore(None)
        self._store.add_rows(*self._rows)
        self._current = None

    def stop(self) -> None:
        if hasattr(self, "_store"):
            self._store.close()

    @consume(others=True)
    def serve(self, request: imc.PlanDB) -> None:
        """Answer a request; one that fails changes nothing."""
        if request.type != Type.REQUEST or not self.is_for_me(request):
            return
        if self._copies.is_duplicate(request):
            answer = self._copies.last_answer(request)
            if answer is not None:
                self.reply(request, answer)
        elif self._is_next(request):
            self._serve(request)
        elif self._wait(request):
            self._progress(request)
        else:
            self._answer(request, Type.FAILURE, TOO_MANY)

    @consume(others=True)
    def keep_started(self, message: imc.PlanControl) -> None:
        """Store a plan that is started or loaded with its specification, once the plan engine has accepted it.

        A plan that is rejected leaves what is stored under its name.
        """
        kinds = imc.PlanControl.Type
        if message.type == kinds.REQUEST:
            own = message.src == self.system and message.dst == UNKNOWN_SYSTEM
            is_for_me = own or message.dst in (self.system, BROADCAST)
            key = message.src, message.src_ent, message.request_id, message.op
            if is_for_me and not _has_specification(message):
                self._unchecked.pop(key, None)  # the next answer is not to a request that had none
            elif is_for_me and not self._copies_of_starts.is_duplicate(message):
                self._unchecked[key] = message
                while len(self._unchecked) > MOST_WAITING:  # without a plan engine there is no answer
                    del self._unchecked[next(iter(self._unchecked))]
        elif message.src == self.system and message.type in (kinds.SUCCESS, kinds.FAILURE):
            key = message.dst, message.dst_ent, message.request_id, message.op
            request = self._unchecked.pop(key, None)
            if request is not None and message.type == kinds.SUCCESS:
                self._keep_when_possible(request)

    def _keep_when_possible(self, request: imc.PlanControl) -> None:
        if self._is_next(request):
            self._keep(request)
        elif not self._wait(request):
            self._refusals.write(self.log.warning, f"{TOO_MANY}: not stored: {request.plan_id!r}", self.now)

    def _is_next(self, request: imc.PlanDB | imc.PlanControl) -> bool:
        """Whether a request can be served now: those of one system in their order, changes as the disk can take them.

        Only the own file is slow, so plans in memory never wait.
        """
        if self._in_memory:
            return True
        if _reads(request):
            return all(request.src != other.src for other in self._waiting)
        return not self._waiting and self._pace.try_acquire(self.now)

    def _wait(self, request: imc.PlanDB | imc.PlanControl) -> bool:
        """Let a request wait for the disk; False if too many do."""
        own = sum(request.src == other.src for other in self._waiting)  # integers
        if len(self._waiting) >= MOST_WAITING or own >= MOST_OF_ONE:
            return False
        self._waiting.append(request)
        if len(self._waiting) == 1:
            self.after(1.0 / CHANGES, self._serve_waiting)
        return True

    def _serve_waiting(self) -> None:
        while self._waiting and (_reads(self._waiting[0]) or self._pace.try_acquire(self.now)):
            request = self._waiting.popleft()
            if isinstance(request, imc.PlanDB):
                self._serve(request)
            else:
                self._keep(request)
        if self._waiting:
            self.after(1.0 / CHANGES, self._serve_waiting)

    def _keep(self, request: imc.PlanControl) -> None:
        plan, answer = request.arg, imc.PlanDB(op=Op.SET, plan_id=request.plan_id)
        assert isinstance(plan, imc.PlanSpecification)
        try:
            stored, new = self._store.set(plan, self._change(request))
        except (sqlite3.Error, StoreFullError) as error:
            info = f"database: {self._reason(error)}"
            self._refusals.write(self.log.warning, f"{info}: {plan.plan_id!r}", self.now)
            self.publish(answer.replace(type=Type.FAILURE, info=info))
        else:
            self.publish(answer.replace(type=Type.SUCCESS, arg=stored.information(), info=_saved(new)))
            self._publish_database_state()

    def _serve(self, request: imc.PlanDB) -> None:
        try:
            self._execute(request)
        except sqlite3.Error as error:
            self._answer(request, Type.FAILURE, f"database: {self._reason(error)}")
        except StoreFullError as error:
            self._answer(request, Type.FAILURE, str(error))

    def _execute(self, request: imc.PlanDB) -> None:
        if request.op == Op.SET:
            self._set(request)
        elif request.op == Op.DEL:
            self._delete(request)
        elif request.op == Op.CLEAR:
            self._progress(request)
            self._store.clear(self._change(request))
            self._answer(request.replace(plan_id=""), Type.SUCCESS, "OK")
            self._publish_database_state()
        elif request.op in (Op.GET, Op.GET_INFO):
            self._get(request)
        elif request.op in (Op.GET_STATE, Op.GET_DSTATE):
            self._answer(request, Type.SUCCESS, "OK", self._state())
        else:
            self._answer(request, Type.FAILURE, f"no such operation: {request.op}")

    def _set(self, request: imc.PlanDB) -> None:
        plan = request.arg
        if not request.plan_id:
            self._answer(request, Type.FAILURE, "undefined plan id")
        elif not isinstance(plan, imc.PlanSpecification):
            self._answer(request, Type.FAILURE, "no plan specification given")
        elif plan.plan_id != request.plan_id:
            self._answer(request, Type.FAILURE, "plan id mismatch")
        else:
            self._progress(request)
            stored, new = self._store.set(plan, self._change(request))
            self._answer(request, Type.SUCCESS, _saved(new), stored.information())
            self._publish_database_state()

    def _delete(self, request: imc.PlanDB) -> None:
        self._progress(request)
        if self._store.delete(request.plan_id, self._change(request)):
            self._answer(request, Type.SUCCESS, "OK")
            self._publish_database_state()
        else:
            self._answer(request, Type.FAILURE, UNDEFINED)

    def _get(self, request: imc.PlanDB) -> None:
        stored: PlanRow | None = self._store.get(request.plan_id)
        if stored is None:
            self._answer(request, Type.FAILURE, UNDEFINED)
        elif request.op == Op.GET_INFO:
            self._answer(request, Type.SUCCESS, "OK", stored.information())
        else:
            try:
                self._answer(request, Type.SUCCESS, "OK", stored.specification())
            except imc.DecodeError as error:
                self._answer(request, Type.FAILURE, f"stored plan is damaged: {error}")

    def _state(self) -> imc.PlanDBState:
        """The state with all plans, without them if they do not fit into one message."""
        if self._current is None:
            self._current = self._store.state()
            try:
                imc.encode(self._current)
            except imc.EncodeError:
                self._current = self._current.replace(plans_info=())
        return self._current

    def _publish_database_state(self) -> None:
        """Publish what is stored now, once a second at most; on a virtual clock it is not needed."""
        self._current = None
        if self.vehicle.has_virtual_time or self._is_due:
            return
        self._is_due = True
        pause = self._published + STATE_PERIOD - self.now
        self.after(min(max(0.0, pause), STATE_PERIOD), self._publish_state)  # the clock may be set

    def _publish_state(self) -> None:
        self._published, self._is_due = self.now, False
        try:
            state = self._state()
        except sqlite3.Error as error:
            self.log.warning(f"database: {self._reason(error)}")
        else:
            self.publish(state)

    def _progress(self, request: imc.PlanDB) -> None:
        self._answer(request, Type.IN_PROGRESS, "in progress")

    def _answer(self, request: imc.PlanDB, kind: Type, info: str, arg: imc.Message | None = None) -> None:
        if kind is Type.FAILURE:
            text = f"{self.vehicle.systems.name(request.src)}: {info}: {request.plan_id!r}"
            self._refusals.write(self.log.warning, text, self.now)
        answer = imc.PlanDB(
            type=kind,
            op=request.op,
            request_id=request.request_id,
            plan_id=truncate_reply(request.plan_id),
            arg=arg,
            info=info,
        )
        self.reply(request, answer)
        self._copies.remember_answer(request, answer)

    def _change(self, request: imc.Message) -> PlanChange:
        return PlanChange(self.now, request.src, self.vehicle.systems.name(request.src))

    def _reply_to_boot(self, kind: Type, info: str) -> None:
        self.publish(imc.PlanDB(type=kind, op=Op.BOOT, info=info, dst=self.system))

    def _reason(self, error: sqlite3.Error | StoreFullError) -> str:
        return str(error) if isinstance(error, StoreFullError) else describe_database_error(error, self._path)

    @property
    def _path(self) -> Path | None:
        """The file, None in memory."""
        return None if self._in_memory else self.vehicle.state_folder / self.system_name / "Plan.db"

    @property
    def _in_memory(self) -> bool:
        return self.storage == "Memory" or (self.storage == "Automatic" and self.vehicle.has_virtual_time)

    def _retry(self) -> None:
        """Use the file as soon as that is possible, with the plans that were kept in memory."""
        plans, changes = self._store.rows()
        try:
            store = self._open(wait=0.0)
            try:
                store.add_rows(plans, changes)
            except sqlite3.Error:
                store.close()
                raise
        except (sqlite3.Error, OSError):
            self.after(RETRY_PERIOD, self._retry)
            return
        self._store.close()
        self._store = store
        self.log.info(f"{self._path} can be used again: plans stored from memory: {len(plans)}")
        self.set_entity_state(State.NORMAL, "active")
        self._publish_database_state()

    def _open(self, wait: float = WAIT) -> PlanStore:
        path = self._path
        if path is None:
            return PlanStore(None)
        try:
            return PlanStore(path, wait)
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError) and "UTF-8" not in str(error):
                raise
            names = (path.with_suffix(f".damaged{number or ''}") for number in range(MOST_DAMAGED))
            aside = next((name for name in names if not name.exists()), path.with_suffix(".damaged"))
            path.replace(aside)
            store = PlanStore(path)
            kept = store.copy_readable(aside)
            self.log.error(f"{path}: {error}; renamed to {aside.name}, of which {kept} plans could be read")
            return store


def _has_specification(request: imc.PlanControl) -> bool:
    ops, plan = imc.PlanControl.Op, request.arg
    is_plan = isinstance(plan, imc.PlanSpecification) and bool(plan.plan_id) and plan.plan_id == request.plan_id
    return is_plan and request.op in (ops.START, ops.LOAD)


def _reads(request: imc.PlanDB | imc.PlanControl) -> bool:
    return isinstance(request, imc.PlanDB) and request.op not in CHANGING


def _saved(new: bool) -> str:
    return "OK (new entry)" if new else "OK (updated)"
