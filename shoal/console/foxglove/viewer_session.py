"""One viewer: what it has subscribed, and answers to what it asks."""

import asyncio
from collections.abc import Callable, Coroutine, Iterable
from functools import partial
from typing import Any

import imc
from shoal.console.access.authority import AuthorityError, Permit
from shoal.console.foxglove import protocol
from shoal.console.foxglove.connection_graph import Graph, consumed_messages, published_topics, task_names
from shoal.console.foxglove.live_feed import LiveFeed
from shoal.console.foxglove.parameters import ParameterAccess, values_of
from shoal.console.foxglove.playback import Playback, PlaybackState, control_words, playback_time
from shoal.console.foxglove.protocol import PlaybackRequest, ProtocolError, ServiceCall, StatusLevel
from shoal.console.foxglove.vehicle_services import VehicleServices, call_answer, call_words
from shoal.console.foxglove.viewer_queue import ViewerQueue
from shoal.console.vehicle_orders import OrderError, carry_out
from shoal.console.vehicle_view import changed_items
from shoal.network import AsyncRemoteVehicle, NetworkError, NetworkSystem
from support.terminal_text import printable

NAME = "Shoal"
WATCHING = ("time", "parameters", "parametersSubscribe", "connectionGraph")
MOST_SUBSCRIPTIONS = 16384
MOST_OF_CHANNEL = 4  # subscriptions of a viewer, each of which gets every message once more
MOST_AT_WORK = 16  # requests of a viewer that vehicles are answering
HOUSEKEEPING = 1.0  # s between looks for new vehicles, for lost messages, and for a changed graph
LONGEST = 1000  # characters of a sentence
UINT32 = 1 << 32


class ViewerSession:
    """Carries out the requests of a viewer. `may_operate`: also those that change something."""

    def __init__(
        self,
        feed: LiveFeed,
        parameters: ParameterAccess,
        services: VehicleServices,
        find_vehicle: Callable[[object, str], AsyncRemoteVehicle],
        permit: Permit,
        *,
        may_operate: bool,
    ) -> None:
        self.queue: ViewerQueue = ViewerQueue()
        self._feed, self._parameters, self._services = feed, parameters, services
        self._find, self._permit, self._may_operate = find_vehicle, permit, may_operate
        self._subscriptions: dict[int, int] = {}
        self._by_channel: dict[int, list[int]] = {}
        self._watched: set[str] = set()
        self._watches_all = False
        self._wants_graph = False
        self._graph: tuple[Graph, Graph, Graph] = ({}, {}, {})
        self._offered = 0
        self._bad = 0
        self._reported = 0
        self._work: set[asyncio.Task[None]] = set()
        self._playback: PlaybackState | None = None

    # Called by the feed

    def on_channels(self, channels: Iterable[protocol.Json]) -> None:
        self.queue.put_answer(protocol.advertise(channels))

    def on_message(self, channel: int, time: int, data: bytes) -> None:
        for subscription in self._by_channel.get(channel, ()):
            self.queue.put_message(protocol.message_data(subscription, time, data))

    def on_time(self, frame: bytes) -> None:
        self.queue.put_message(frame)

    def on_parameters(self, system: NetworkSystem, message: imc.EntityParameters) -> None:
        known = {each.name: each.value for each in message.params if isinstance(each, imc.EntityParameter)}
        self._send_values(values_of(system.name, message.name, known))

    def on_playback(self, state: PlaybackState) -> None:
        """Send a state of the log that differs from the one before."""
        if self._may_operate and state != self._playback:
            self._send_playback(state, "", did_seek=self._playback is not None and self._playback.jumps != state.jumps)

    # Called by the connection

    def start(self) -> "asyncio.Task[None]":
        """Send what a viewer gets first, and feed it; returns what feeds it, and raises if that fails."""
        capabilities = [*WATCHING, *(["services"] if self._may_operate else [])]
        playback = self._feed.playback if self._may_operate else None
        span = None if playback is None else (playback_time(playback.start), playback_time(playback.end))
        capabilities += ["playbackControl"] if span is not None else []
        role = {"role": "operate" if self._may_operate else "watch"}
        self.queue.put_answer(protocol.server_info(NAME, capabilities, self._feed.session, role, span))
        return self._feed.add(self)

    def end(self) -> None:
        """Let all work for the viewer end. An order that was sent stays sent."""
        self._feed.remove(self)
        for task in self._work:
            task.cancel()

    async def keep_house(self) -> None:
        """Offer services of new vehicles, and report lost messages and a changed graph, for ever."""
        while True:
            self._offer_services()
            if self.queue.dropped > self._reported:
                self._feed.counts["messages dropped: a viewer is slow"] += self.queue.dropped - self._reported
                self._reported = self.queue.dropped
                words = f"{self._reported} messages were dropped: this viewer, or its network, is too slow"
                self.queue.put_answer(protocol.status(StatusLevel.WARNING, words, "dropped"))
            if self._wants_graph:
                await self._send_graph()
            await asyncio.sleep(HOUSEKEEPING)

    def take(self, frame: str | bytes) -> None:
        """Carry out a request; one that is wrong is counted, and answered with the reason."""
        try:
            if isinstance(frame, bytes):
                self._take_binary(protocol.parse_binary(frame))
            else:
                self._carry_out(protocol.parse_text(frame))
        except ProtocolError as error:
            self._bad += 1
            self._feed.counts["frames of viewers that were rejected"] += 1
            self._report(f"{error} (rejected frame {self._bad})")
            if error.playback_request is not None and self._may_operate:
                self._answer_playback(error.playback_request)

    def _carry_out(self, request: protocol.Request) -> None:
        match request:
            case protocol.Subscribe():
                for each in request.subscriptions:
                    self._subscribe(each.id, each.channel_id)
            case protocol.Unsubscribe():
                for number in request.subscription_ids:
                    self._unsubscribe(number)
            case protocol.GetParameters():
                self._do(self._get_parameters(request))
            case protocol.ChangeParameters():
                if not self._may_operate:
                    raise ProtocolError("this viewer may watch only: no parameter was set")
                self._do(self._set_parameters(request))
            case protocol.SubscribeParameterUpdates():
                self._watches_all |= not request.parameter_names
                if len(self._watched) < MOST_SUBSCRIPTIONS:
                    self._watched.update(request.parameter_names)
            case protocol.UnsubscribeParameterUpdates():
                self._watches_all &= bool(request.parameter_names)
                self._watched = self._watched.difference(request.parameter_names) if request.parameter_names else set()
            case protocol.SubscribeConnectionGraph():
                if not self._wants_graph:
                    self._wants_graph, self._graph = True, ({}, {}, {})
                    self._do(self._ask_for_tasks())
            case protocol.UnsubscribeConnectionGraph():
                self._wants_graph = False

    def _subscribe(self, subscription: int, channel: int) -> None:
        if not 0 <= subscription < UINT32:
            raise ProtocolError(f"the number of a subscription is from 0 to {UINT32 - 1}")
        if channel not in self._feed.channels:
            raise ProtocolError(f"there is no channel {channel}")
        if subscription in self._subscriptions:
            raise ProtocolError(f"subscription {subscription} exists")
        if len(self._subscriptions) >= MOST_SUBSCRIPTIONS:
            raise ProtocolError(f"a viewer has at most {MOST_SUBSCRIPTIONS} subscriptions")
        others = self._by_channel.get(channel, [])
        if len(others) >= MOST_OF_CHANNEL:
            raise ProtocolError(f"a viewer has at most {MOST_OF_CHANNEL} subscriptions of a channel")
        self._subscriptions[subscription] = channel
        self._by_channel[channel] = [subscription]  # the last message is for the new subscription only
        self._feed.subscribe(self, channel)
        self._by_channel[channel] = [*others, subscription]

    def _unsubscribe(self, subscription: int) -> None:
        channel = self._subscriptions.pop(subscription, None)
        if channel is None:
            raise ProtocolError(f"there is no subscription {subscription}")
        self._by_channel[channel].remove(subscription)
        self._feed.unsubscribe(self, channel)

    def _do(self, work: Coroutine[Any, Any, None], refuse: Callable[[str], object] | None = None) -> None:
        """Work on a request while others are taken; `refuse` gets the reason if that fails."""
        if len(self._work) >= MOST_AT_WORK:
            work.close()
            raise ProtocolError(f"{MOST_AT_WORK} requests are waiting for vehicles")
        task = asyncio.create_task(self._answer_failure(work, refuse or self._report))
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    async def _answer_failure(self, work: Coroutine[Any, Any, None], refuse: Callable[[str], object]) -> None:
        try:
            await work
        except Exception as error:  # nothing that a viewer asks for may leave it without an answer
            self._feed.counts[f"requests that failed: {type(error).__name__}"] += 1
            refuse(printable(f"the console has failed: {type(error).__name__}: {error}")[:LONGEST])

    async def _get_parameters(self, request: protocol.GetParameters) -> None:
        values = await self._parameters.get(request.parameter_names, self._report)
        self.queue.put_answer(protocol.parameter_values(values, request.id))

    async def _set_parameters(self, request: protocol.ChangeParameters) -> None:
        values = await self._parameters.set(request.parameters, self._permit, self._report)
        if request.id is not None:
            self.queue.put_answer(protocol.parameter_values(values, request.id))

    def _send_values(self, values: Iterable[protocol.Json]) -> None:
        wanted = [value for value in values if self._watches_all or value["name"] in self._watched]
        if wanted:
            self.queue.put_answer(protocol.parameter_values(wanted, None))

    def _offer_services(self) -> None:
        services = self._services.of_systems([system.name for system in self._feed.network.vehicles()])
        if self._may_operate and len(services) > self._offered:
            new, self._offered = services[self._offered :], len(services)
            self.queue.put_answer(protocol.advertise_services(each.advertisement() for each in new))

    def _take_binary(self, request: ServiceCall | PlaybackRequest) -> None:
        if isinstance(request, ServiceCall):
            self._call(request)
            return
        playback = self._feed.playback
        if playback is None:
            raise ProtocolError("no log is played here")
        if not self._may_operate:
            raise ProtocolError("this viewer may watch only: the log was not moved")
        try:
            self._do(self._control(request, playback), partial(self._refuse_control, request.id))
        except ProtocolError as error:
            raise ProtocolError(str(error), request.id) from None

    async def _control(self, request: PlaybackRequest, playback: Playback) -> None:
        """Play, pause or move the log; the answer comes in any case, with the state as it is then."""
        before = self._feed.playback_state
        try:
            await playback.control(control_words(request, playback))
        except ValueError as error:
            self._report(str(error))
        self._answer_playback(request.id, before)

    def _refuse_control(self, request: str, reason: str) -> None:
        self._report(reason)
        self._answer_playback(request)

    def _answer_playback(self, request: str, before: PlaybackState | None = None) -> None:
        """Send the present state with the id of a request, as the protocol wants it for each; `before` is its state."""
        state = self._feed.playback_state
        if state is not None:
            self._send_playback(state, request, did_seek=before is not None and before.jumps != state.jumps)

    def _send_playback(self, state: PlaybackState, request: str, *, did_seek: bool) -> None:
        self._playback = state
        playback = self._feed.playback
        now = 0 if playback is None else playback_time(playback.now)
        self.queue.put_answer(protocol.playback_state_data(state.status, now, state.speed, request, did_seek=did_seek))

    def _call(self, call: ServiceCall) -> None:
        service = self._services.by_number.get(call.service)
        try:
            if not self._may_operate:
                raise ProtocolError("this viewer may watch only: no order was sent")
            if service is None:
                raise ProtocolError(f"there is no service {call.service}")
            words = call_words(service, call)
            self._do(self._order(call, service.system, service.order, words), partial(self._refuse_call, call))
        except ProtocolError as error:
            self.queue.put_answer(protocol.call_failure(call, str(error)))
            raise

    def _refuse_call(self, call: ServiceCall, reason: str) -> None:
        self.queue.put_answer(protocol.call_failure(call, reason))

    async def _order(self, call: ServiceCall, system: str, order: str, words: Any) -> None:
        try:
            vehicle = self._find(system, order)
            self._permit(system, order, words)
            text, done = await carry_out(vehicle, order, words), True
        except (AuthorityError, OrderError, NetworkError, ValueError) as error:
            text, done = str(error), False
        self.queue.put_answer(protocol.call_response(call, call_answer(call, done, printable(text))))

    async def _ask_for_tasks(self) -> None:
        """Ask the vehicles for their tasks, which the graph consists of."""
        for system in self._feed.network.vehicles():
            try:
                vehicle = self._find(system.name, "")
                await vehicle.param.components(await vehicle.param.entity_ids())
            except NetworkError as error:
                self._report(f"{system.name}: {error}")

    async def _send_graph(self) -> None:
        """Send what has changed in the graph."""
        systems = self._feed.network.systems
        tasks = {name for system in systems.values() if system.is_shoal for name in task_names(system)}
        await asyncio.to_thread(lambda: [consumed_messages(task) for task in tasks])  # the first import takes long
        published, consumed = published_topics(self._feed.publishers(), systems)
        services = {each.name: frozenset((each.system,)) for each in self._services.by_number.values()}
        offered: Graph = services if self._may_operate else {}
        now, before = (published, consumed, offered), self._graph
        changed = [changed_items(old, new) for old, new in zip(before, now, strict=True)]
        removed = (before[0].keys() | before[1].keys()) - published.keys() - consumed.keys()
        if any(changed) or removed:
            self._graph = now
            self.queue.put_answer(protocol.connection_graph_update(changed[0], changed[1], changed[2], removed))

    def _report(self, text: str) -> None:
        self.queue.put_answer(protocol.status(StatusLevel.ERROR, printable(text)[:LONGEST]))
