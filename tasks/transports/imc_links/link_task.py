"""A task that sends the messages of a list to peers: the options that all of them have, and the subscriptions."""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import imc
from imc.console_acl import GENERAL, ConsoleAcl, OrderRefusals
from imc.schema import message_named
from runtime import Task, consume, param
from runtime.bus import Subscription
from runtime.profile import listed_consoles, split_list
from runtime.task import ParameterError
from support.diagnostics import ConfigWarning
from support.terminal_text import corrected_spelling, quoted, suggestion
from tasks.transports.imc_links.custom_filters import parse_custom
from tasks.transports.imc_links.large_answers import LargeAnswers
from tasks.transports.imc_links.message_list import (
    MessageList,
    check_entity_filter,
    check_rate_limiter,
    parse_entities,
    parse_rate,
)
from tasks.transports.imc_links.own_announce import is_for_log
from tasks.transports.imc_links.sockets import network_time

T = TypeVar("T")

STATES = (imc.Announce, imc.EstimatedState, imc.FuelLevel, imc.PlanControlState, imc.VehicleState)
"""Messages that a new system receives at once, if they are listed; some come only every 10 s."""


def reraise_as_parameter_error(option: str, make: Callable[[], T]) -> T:
    """The value that `make` reads from an option. Raises ParameterError."""
    try:
        return make()
    except ValueError as error:
        raise ParameterError(option, str(error)) from None


class ImcLinkTask(Task):
    """Sends listed messages of the bus to peers. Subclasses define how by `transmit`, when with `set_subscriptions`.

    Without receivers it only keeps the last states. What a subclass puts on the bus with `relay` does not come back
    to it.
    """

    external = True

    transports: list[str] = param([], "", "Names of the messages to send.", usable=message_named)
    rate_limiters: list[str] = param(
        [], "", "Most messages per second and entity that are sent, MESSAGE:HZ.", usable=check_rate_limiter
    )
    filtered_entities: list[str] = param(
        [],
        "",
        "Entities whose messages are sent, MESSAGE:LABEL+LABEL; those of others are not.",
        usable=check_entity_filter,
    )
    custom_filters: list[str] = param(
        [],
        "",
        "EntityStateChangeFilter:LABEL+LABEL sends only changed states, of these entities or all; "
        "LogBookEntryFilter:ERROR+WARNING only these types.",
        usable=parse_custom,
    )
    local_messages_only: bool = param(
        True, "", "Send only messages of this vehicle, not those received from other systems."
    )
    loopback_internal_messages: bool = param(True, "", "Send the messages of this task itself.", editable=False)
    consoles: list[str] = param(
        [],
        "",
        "Systems that may command over this link, NAME or NAME@ADDRESS; others then only report. Empty means [General] "
        "Consoles, and if that is empty, too, all may.",
        editable=False,
    )

    def configure(self) -> None:
        self.commanders: ConsoleAcl = listed_consoles(self, self.consoles)
        place = f"[{self.name}] Consoles" if any(map(str.strip, self.consoles)) else GENERAL
        self.refusals: OrderRefusals = OrderRefusals(self.vehicle.name, self.system, place)
        self.messages: MessageList = self.message_list(self.transports, self.rate_limiters)
        self.configure_peers()
        if getattr(self, "subscriptions", None) is not None:
            self.set_subscriptions_enabled(False)
            self.refresh_subscriptions()

    def configure_peers(self) -> None:
        """Read further parameters; `commanders` and `messages` are there already. Raises ParameterError."""

    def refresh_subscriptions(self) -> None:
        """Call `set_subscriptions`, according to whether there is somebody to send to, after a change of parameters."""

    def message_list(self, names: Iterable[str], rates: Iterable[str]) -> MessageList:
        """A list with the entity filters of this task, and with [General] Console Messages. Raises ParameterError."""
        everywhere = split_list(self.vehicle.profile.value("General", "Console Messages", ""))
        limited = [item for item in everywhere if ":" in item]
        reraise_as_parameter_error("Console Messages", lambda: [parse_rate(item) for item in limited])
        names = [*names, *(item.partition(":")[0] for item in everywhere)]
        rates, entities, custom = [*limited, *rates], self.filtered_entities, self.custom_filters
        reraise_as_parameter_error("Rate Limiters", lambda: [parse_rate(item) for item in rates if item.strip()])
        reraise_as_parameter_error(
            "Filtered Entities", lambda: [parse_entities(item) for item in entities if item.strip()]
        )
        reraise_as_parameter_error("Custom Filters", lambda: [parse_custom(item) for item in custom if item.strip()])
        schema, label = self.vehicle.bus.messages, self.vehicle.entities.label
        return MessageList(names, rates, entities, custom, schema=schema, label=label)

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        known = self.vehicle.entities.labels
        for option, labels in self.filter_entity_labels():
            for label in sorted(labels.difference(known)):
                near = corrected_spelling(label, known)
                # Several are a list that vehicles share: it names entities that only some of them have.
                if near or (len(labels) == 1 and self.local_messages_only):
                    text = f"{option}: no task of the profile has the entity {quoted(label)}"
                    yield ConfigWarning(
                        option, text, f"did you mean {quoted(near)}?" if near else suggestion(label, known)
                    )

    def filter_entity_labels(self) -> Iterator[tuple[str, frozenset[str]]]:
        """The labels in each item of the filters, with the option that has it."""
        for item in filter(str.strip, self.filtered_entities):
            yield "Filtered Entities", parse_entities(item)[1]
        for kind, words in map(parse_custom, filter(str.strip, self.custom_filters)):
            if not kind.words:
                yield "Custom Filters", words

    def start(self) -> None:
        self.subscriptions: list[Subscription] = []
        self.large_answers: LargeAnswers = LargeAnswers()
        self.states: dict[tuple[type, int], tuple[imc.Message, bytes]] = {}
        for kind in STATES:
            self.vehicle.bus.subscribe(Subscription(kind, self.keep_state, self, packets=True))
        if self.messages.unknown:
            self.log.warning(f"no such message: {', '.join(self.messages.unknown)}")

    @consume(others=True)
    def on_picture_request(self, request: imc.ImageTxSettings) -> None:
        """Note who has asked for pictures over the bus."""
        self.large_answers.on_request(request, network_time(self))

    def keep_state(self, state: imc.Message, packet: bytes) -> None:
        if isinstance(state, imc.Announce) and is_for_log(state):
            return
        self.states[type(state), state.src_ent] = state, packet

    def last_states(self, messages: MessageList) -> Iterator[bytes]:
        """The packets with the last states, as far as they are listed; first the name of the vehicle."""
        kept = sorted(self.states.values(), key=lambda kept: kept[0].ID != imc.Announce.ID)
        return (packet for state, packet in kept if messages.passes_ignoring_rate(state))

    def set_subscriptions_enabled(self, wanted: bool) -> None:
        """Let the bus call `transmit` with each message of the list, or no longer."""
        if wanted == bool(self.subscriptions):
            return
        for subscription in self.subscriptions:
            self.vehicle.bus.remove_subscription(subscription)
        kinds, others = self.sent_types() if wanted else (), not self.local_messages_only
        self.subscriptions = [Subscription(kind, self.transmit, self, others=others, packets=True) for kind in kinds]
        for subscription in self.subscriptions:
            self.vehicle.bus.subscribe(subscription)

    def sent_types(self) -> Iterable[type[imc.Message]]:
        """The types of messages to send."""
        return self.messages.types

    def transmit(self, message: imc.Message, packet: bytes) -> None:
        """Send a message of the list, if its filters pass, to its receivers; a subclass defines how."""
