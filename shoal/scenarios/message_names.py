"""Names and functions in a scenario: messages of vehicles, their arrivals, what has held, captured values."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol

import imc
from imc.expressions import (
    ExpressionCompiler,
    FieldPlace,
    LatestMessages,
    NameScope,
    Operand,
    RobustnessFunction,
    contains_position,
)
from runtime.kernel import SECOND
from shoal.scenarios.scenario_condition import (
    ArrivalSelector,
    BottomSelector,
    CaptureSelector,
    HeldSelector,
    MessageSelector,
    ScenarioCondition,
    Selector,
)
from shoal.scenarios.world_bottom import altitude
from support.expressions import Call, CapturedName, Name, SyntaxNode
from support.terminal_text import with_suggestion

RATE_WINDOW = 10.0  # s
_PLANS = ("true", "maneuverisdone")


class JoiningLink(Protocol):
    """A link, as far as it decides what arrives: `messages` are those that it carries, all if it is empty."""

    @property
    def name(self) -> str: ...
    @property
    def ends(self) -> tuple[str, ...]: ...
    @property
    def messages(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class ExpressionScope:
    """The vehicles whose messages a text may name, with their schemas; `vehicle` is meant if it names none.

    `links` are those over which vehicles receive messages, `captures` the units of captured values by name.
    """

    vehicles: Mapping[str, imc.Schema]
    vehicle: str = ""
    links: "tuple[JoiningLink, ...]" = ()
    captures: Mapping[str, str] = field(default_factory=lambda: MappingProxyType[str, str]({}))


class ScenarioNames(NameScope):
    """The names of one text; `selectors` are what it looks at, by their slots."""

    functions: tuple[str, ...] = ("age", "altitude", "count", "held", "rate")

    def __init__(self, scope: ExpressionScope):
        self.selectors: dict[Selector, int] = {}
        self._scope = scope

    def place(self, node: Name) -> FieldPlace | None:
        scope = self._scope
        vehicle = node.vehicle or scope.vehicle
        if vehicle not in scope.vehicles and node.vehicle:
            raise node.error(with_suggestion(f"there is no vehicle {vehicle!r}", vehicle, scope.vehicles))
        schema = scope.vehicles.get(vehicle, imc.builtin())
        if node.name not in schema:
            if node.is_bare:
                return None
            messages = [kind.abbrev for kind in schema.types_by_id.values()]
            raise node.error(with_suggestion(f"there is no message {node.name!r}", node.name, messages))
        if vehicle not in scope.vehicles:
            raise node.error(f"{node.text!r}: there are several vehicles; write @NAME behind it, or vehicle: NAME")
        kind = self._received_kind(node, vehicle) if node.receiver else schema[node.name]
        selector = MessageSelector(kind, vehicle, node.entity or "", node.receiver)
        return FieldPlace(kind, self._slot(selector), node.path)

    def captured(self, node: CapturedName) -> Operand:
        captures = self._scope.captures
        if node.name not in captures:
            reason = f"{node.text}: no value with this name is captured before"
            raise node.error(with_suggestion(reason, node.name, captures))
        slot = self._slot(CaptureSelector(node.name))
        return Operand(
            node,
            lambda latest: latest[slot].value,
            unready=(lambda latest: not latest[slot].is_there,),
            unit=captures[node.name],
        )

    def operand(self, node: Call, compiler: ExpressionCompiler) -> Operand | None:
        match node.function:
            case "age":
                arrivals = self._arrivals(node, compiler)
                never = _never_arrived(arrivals)
                return Operand(node, lambda latest: latest[arrivals].age(), may_grow=never, unit="s")
            case "count":
                arrivals = self._arrivals(node, compiler)
                return Operand(node, lambda latest: float(latest[arrivals].count), unready=_NOT_CONSTANT)
            case "rate":
                seconds = self._seconds(node, node.arguments[1], compiler) if len(node.arguments) == 2 else RATE_WINDOW
                arrivals = self._arrivals(node, compiler, seconds)
                unready = _window_is_open(arrivals)
                return Operand(node, lambda latest: latest[arrivals].rate(), unready=(unready,), unit="Hz")
            case "altitude":
                return self._altitude(node, compiler)
            case _:
                return None

    def test(self, node: Call | Name, compiler: ExpressionCompiler) -> RobustnessFunction | None:
        word = node.function if isinstance(node, Call) else node.name if node.is_bare else ""
        if word.lower() in _PLANS:
            raise node.error(
                f"{node.text!r} is for plans only: compare PlanControlState.man_id or .state instead",
            )
        if not isinstance(node, Call) or node.function != "held":
            return None
        if len(node.arguments) != 2:
            raise node.error("held takes a condition and a time: held(EstimatedState.depth < 1 m, 5 s)")
        inner = ScenarioNames(self._scope)
        test = ExpressionCompiler(inner).test(node.arguments[0])
        if not inner.selectors:
            raise node.arguments[0].error(f"{node.arguments[0].text}: names no message, so nothing can change it")
        condition = ScenarioCondition(node.arguments[0].text, tuple(inner.selectors), test)
        slot = self._slot(HeldSelector(condition, self._seconds(node, node.arguments[1], compiler)))
        for selector in inner.selectors:
            self._slot(selector)
        return lambda latest, unknown: latest[slot].margin(unknown)

    def _slot(self, selector: Selector) -> int:
        return self.selectors.setdefault(selector, len(self.selectors))

    def _received_kind(self, node: Name, sender: str) -> type[imc.Message]:
        """The message in the receiver's schema. Raises ExpressionError if it cannot arrive there."""
        receiver, vehicles = node.receiver, self._scope.vehicles
        if receiver not in vehicles:
            raise node.error(with_suggestion(f"there is no vehicle {receiver!r}", receiver, vehicles))
        if receiver == sender:
            raise node.error(f"{node.text!r}: {sender} receives nothing from itself")
        joined = [link for link in self._scope.links if sender in link.ends and receiver in link.ends]
        if not joined:
            raise node.error(f"{node.text!r}: no link joins {sender} and {receiver}")
        if not any(not link.messages or node.name in link.messages for link in joined):
            names = ", ".join(link.name for link in joined)
            raise node.error(f"{node.text!r}: the link {names} does not carry {node.name}")
        if node.name not in vehicles[receiver]:
            raise node.error(f"{receiver} has no message {node.name!r}")
        return vehicles[receiver][node.name]

    def _arrivals(self, node: Call, compiler: ExpressionCompiler, seconds: float = 0.0) -> int:
        """The slot of the arrivals of the message that is the first argument."""
        most = 2 if node.function == "rate" else 1
        if not 1 <= len(node.arguments) <= most:
            also = ", and at will a time" if most == 2 else ""
            raise node.error(f"{node.function} takes a message{also}, such as {node.function}(GpsFix)")
        place = compiler.message(node.arguments[0], node.function)
        message = list(self.selectors)[place.slot]
        assert isinstance(message, MessageSelector)
        return self._slot(ArrivalSelector(message, round(seconds * SECOND)))

    def _altitude(self, node: Call, compiler: ExpressionCompiler) -> Operand:
        if len(node.arguments) != 1:
            raise node.error("altitude takes a message, such as altitude(SimulatedState)")
        place = compiler.message(node.arguments[0], node.function)
        if not contains_position(place.kind, deep=True):
            raise node.error(f"{place.kind.__name__} has no position of a vehicle")
        message = list(self.selectors)[place.slot]
        assert isinstance(message, MessageSelector)
        of, bottom = place.slot, self._slot(BottomSelector(message.vehicle))
        return Operand(node, lambda latest: altitude(latest[of], latest[bottom]), frozenset((of, bottom)), unit="m")

    def _seconds(self, node: Call, argument: SyntaxNode, compiler: ExpressionCompiler) -> float:
        found = compiler.operand(argument)
        found.check_is_number()
        if found.unit not in ("", "s") or not found.is_constant:
            raise argument.error(f"{argument.text}: {node.function} takes a time that is a number, such as 5 s")
        seconds = float(found.value(()))
        if not 1e-3 <= seconds <= 1e6:
            raise argument.error(f"{argument.text}: the time of {node.function} is from 1 ms to 1e6 s")
        return seconds


def _never_arrived(slot: int) -> Callable[[LatestMessages], bool]:
    return lambda latest: not latest[slot].count


def _window_is_open(slot: int) -> Callable[[LatestMessages], bool]:
    return lambda latest: latest[slot].is_window_open()


_NOT_CONSTANT: tuple[Callable[[LatestMessages], bool], ...] = (lambda _: False,)
