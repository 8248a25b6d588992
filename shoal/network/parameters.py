"""The parameters of a vehicle's tasks, by the label of the entity."""

import asyncio
import time
from collections.abc import Collection, Mapping
from contextlib import suppress

import imc
from shoal.network.link import NoAnswer, Refused
from shoal.network.message_listener import MessageListener
from shoal.network.network import Network
from shoal.network.system_table import NetworkSystem
from support.terminal_text import suggestion
from support.text_length import list_first

ROUNDS = 12  # of questions at most
CERTAIN = 1e-3  # expected number of entities whose answers all got lost, below which silence means no parameters
SHORT = 1.2  # s for the first question: there may be no such entity
QUIET = 0.5  # s without an answer: there are no more
NAMED = 8  # silent entities in an error
OLD_VALUES_STAY = "; the old values stay"  # end of the vehicle's error about values that do not fit together
AT_ONCE = 50  # questions; a vehicle gives a console 200 answers a second


class PartialAnswer(NoAnswer):
    """Some entities have not answered, `missing`: `found` has the parameters of the others, by label and name."""

    def __init__(self, system: str, found: Mapping[str, Mapping[str, str]], missing: Collection[str]) -> None:
        named = list_first(missing, NAMED)
        super().__init__(
            f"{system}: no answer from {len(missing)} entities ({named}), though they were asked repeatedly"
        )
        self.found = found
        self.missing: tuple[str, ...] = tuple(missing)


class AsyncRemoteParameters:
    """Reads and sets parameters. Values are texts, as in a profile."""

    def __init__(self, network: Network, system: NetworkSystem) -> None:
        self._network = network
        self._system = system

    async def entity_ids(self) -> dict[str, int]:
        """The ids of all entities of the vehicle, by label."""
        query = imc.EntityList(op=imc.EntityList.Op.QUERY)

        def answer(message: imc.Message) -> dict[str, int] | None:
            if not isinstance(message, imc.EntityList) or message.op != imc.EntityList.Op.REPORT:
                return None
            pairs = (entry.rpartition("=") for entry in message.list.split(";"))
            return {label: int(number) for label, _, number in pairs if label and number.isdecimal()}

        return await self._network.request(self._system, query, (imc.EntityList,), answer)

    async def components(self, labels: Mapping[str, int]) -> dict[str, str]:
        """The task of each entity, such as Control.Path, by label; those that do not report it are missing.

        `labels` are the ids of the entities that are asked.
        """
        found: dict[int, str] = {}
        listener = self._network.listen(self._system, (imc.EntityInfo,))
        try:
            for _ in range(ROUNDS):
                waiting = [number for number in labels.values() if number not in found]
                for start in range(0, len(waiting), AT_ONCE):
                    for number in waiting[start : start + AT_ONCE]:
                        self._network.send(self._system, imc.QueryEntityInfo(id=number, dst_ent=number))
                    asked, last = {*waiting[start : start + AT_ONCE]}, time.monotonic()
                    with suppress(TimeoutError):
                        while not found.keys() >= asked and time.monotonic() - last < QUIET:
                            _, message = await listener.next(QUIET)  # others may ask, too, and get answers for ever
                            if isinstance(message, imc.EntityInfo) and message.src == self._system.id:
                                last = last if message.src_ent in found else time.monotonic()
                                found[message.src_ent] = message.component
                    self._network.check_is_there(self._system)
                if not waiting:
                    break
        finally:
            self._network.close_listener(listener)
        return {label: found[number] for label, number in labels.items() if found.get(number)}

    async def list(self) -> dict[str, dict[str, str]]:
        """The parameters of all entities that have any, by label and name.

        An entity that stays silent has none, if it was asked often enough for the losses of the network. A Shoal
        vehicle answers for each. Raises PartialAnswer if answers are missing.
        """
        return await self.read(await self.entity_ids())

    async def read(self, labels: Collection[str]) -> dict[str, dict[str, str]]:
        """The same for these entities only."""
        found: dict[str, dict[str, str]] = {}
        waiting, lost = [*labels], 0
        listener = self._network.listen(self._system, (imc.EntityParameters,))
        try:
            for number in range(1, ROUNDS + 1):
                for start in range(0, len(waiting), AT_ONCE):
                    asked, last = waiting[start : start + AT_ONCE], time.monotonic()
                    for label in asked:
                        self._network.send(self._system, _query(label))
                    while not found.keys() >= {*asked} and time.monotonic() - last < QUIET:
                        try:
                            _, message = await listener.next(QUIET)
                        except TimeoutError:
                            break
                        if isinstance(message, imc.EntityParameters) and message.name in {*labels} - found.keys():
                            found[message.name] = _values(message)
                            last = time.monotonic()
                    self._network.check_is_there(self._system)
                before = len(waiting)
                waiting = [label for label in waiting if label not in found]
                lost += (before - len(waiting)) * (number - 1)
                # Each entity that answered in round n has lost n - 1 answers; half a loss is assumed before any.
                loss = (lost + 0.5) / (lost + len(found) + 1.0)
                certain = not self._system.is_shoal and len(waiting) * loss**number < CERTAIN
                if not waiting or (certain and number > 1):
                    break
            else:
                raise PartialAnswer(self._system.name, _with_parameters(found), waiting)
        finally:
            self._network.close_listener(listener)
        return _with_parameters(found)

    async def get(self, entity: str) -> dict[str, str]:
        """The parameters of one entity by name. Raises Refused if there is no such entity or it has none.

        Raises NoAnswer if it is silent: then that is not known.
        """
        try:
            return self._checked(entity, await self._read(entity, SHORT))
        except NoAnswer:
            labels = await self.entity_ids()
        if entity not in labels:
            hint = suggestion(entity, labels) or "`shoal param VEHICLE list` lists them"
            raise Refused(f"no entity {entity!r}; {hint}")
        try:
            return self._checked(entity, await self._read(entity))  # the answers may have got lost
        except NoAnswer as error:
            raise NoAnswer(f"{entity} does not answer: it has no parameters, or {error}") from None

    def _checked(self, entity: str, values: dict[str, str]) -> dict[str, str]:
        if not values:
            raise Refused(f"{entity} has no parameters")
        return values

    async def _read(self, entity: str, timeout: float | None = None) -> dict[str, str]:
        kinds = (imc.EntityParameters,)
        answer = self._network.request(self._system, _query(entity), kinds, lambda m: _of(m, entity), timeout=timeout)
        return await answer

    async def set(self, entity: str, values: Mapping[str, str | float]) -> dict[str, str]:
        """Set parameters of one entity; returns those that were accepted. Raises Refused with the vehicle's reasons.

        A value may be a number, True or False, too. Raises NoAnswer if it is not known whether they were accepted.

        What was accepted before a refusal stays.
        """
        known = await self.get(entity)
        for name in values:
            check_parameter_name(entity, name, known)
        texts = {name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in values.items()}
        params = tuple(imc.EntityParameter(name=name, value=text) for name, text in texts.items())
        request = imc.SetEntityParameters(name=entity, params=params)

        refused: set[str] = set()

        def answer(message: imc.Message) -> dict[str, str] | None:
            """The accepted values, none if all are rejected. A late answer to the query above has the others, too."""
            if isinstance(message, imc.LogBookEntry):
                refused.update(refusal_reasons(message, texts))
                return {} if len(refused) == len(texts) else None
            found = _of(message, entity)
            return found if found is not None and set(found) <= set(values) else None

        log = self._network.listen(self._system, (imc.LogBookEntry,))
        try:
            kinds = (imc.EntityParameters, imc.LogBookEntry)
            try:
                accepted = await self._network.request(self._system, request, kinds, answer)
            except NoAnswer as error:  # the answer may have got lost, or the request
                now = await self._read(entity)
                accepted = {name: now[name] for name in values if is_same_value(now.get(name, ""), texts[name])}
                if left := [f"{name} is still {now.get(name, '')!r}" for name in values if name not in accepted]:
                    raise NoAnswer(f"{entity}: {', '.join(left)}; {error}") from None
            if missing := [name for name in values if name not in accepted]:
                raise Refused("; ".join([await self._reason(log, entity, name, texts[name]) for name in missing]))
            return accepted
        finally:
            self._network.close_listener(log)

    async def save(self, entity: str) -> None:
        """Let the vehicle keep the values of an entity for its next start. Raises Refused if it cannot."""
        label = entity

        def answer(message: imc.Message) -> imc.LogBookEntry | None:
            ours = isinstance(message, imc.LogBookEntry) and message.text.startswith(f"parameters of {label} ")
            return message if isinstance(message, imc.LogBookEntry) and ours else None

        await self.get(entity)
        reply = await self._network.request(
            self._system, imc.SaveEntityParameters(name=entity), (imc.LogBookEntry,), answer
        )
        if reply.type >= imc.LogBookEntry.Type.ERROR:
            raise Refused(reply.text)

    async def _reason(self, log: MessageListener, entity: str, name: str, value: str) -> str:
        """Reason for which a value was rejected, from the log book of the vehicle."""
        with suppress(TimeoutError):
            async with asyncio.timeout(QUIET):  # of all entries: there may be others again and again
                while True:
                    _, entry = await log.next()
                    if isinstance(entry, imc.LogBookEntry) and refusal_reasons(entry, {name: value}):
                        return f"{entity}: {entry.text}"
        return f"{entity}: {name} = {value!r} was not accepted"


def check_parameter_name(entity: str, name: str, known: Collection[str]) -> None:
    """Raises Refused if an entity has no parameter of this name."""
    if name not in known:
        hint = suggestion(name, known) or f"`shoal param VEHICLE get {entity!r}` lists them"
        raise Refused(f"{entity} has no parameter {name!r}; {hint}")


def refusal_reasons(entry: imc.LogBookEntry, values: Mapping[str, str]) -> dict[str, str]:
    """The reasons in an entry of the log book of a Shoal vehicle for values that it rejects, by name.

    If the task itself rejects new values, all old ones stay.
    """
    if entry.text.endswith(OLD_VALUES_STAY):
        return dict.fromkeys(values, entry.text)
    return {name: entry.text for name, text in values.items() if entry.text.startswith(f"{name} = {text!r} ")}


def _with_parameters(found: Mapping[str, dict[str, str]]) -> dict[str, dict[str, str]]:
    return {entity: values for entity, values in sorted(found.items()) if values}


def is_same_value(text: str, other: str) -> bool:
    """Whether two texts are the same value, such as `2, 3` and `2.0, 3.0`."""
    words, others = ([word.strip() for word in each.split(",")] for each in (text, other))
    return len(words) == len(others) and all(map(_is_same_word, words, others))


def _is_same_word(word: str, other: str) -> bool:
    with suppress(ValueError):
        return float(word) == float(other)
    return word.casefold() == other.casefold()


def _query(entity: str) -> imc.QueryEntityParameters:
    return imc.QueryEntityParameters(name=entity, visibility="developer", scope="global")


def _of(message: imc.Message, entity: str) -> dict[str, str] | None:
    return _values(message) if isinstance(message, imc.EntityParameters) and message.name == entity else None


def _values(message: imc.EntityParameters) -> dict[str, str]:
    return {entry.name: entry.value for entry in message.params if isinstance(entry, imc.EntityParameter)}
