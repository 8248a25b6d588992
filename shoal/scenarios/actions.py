"""Actions of events on a vehicle; the log of the vehicle has each of them."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.fault_injection import Fault
from runtime.task import Parameter, Task, find_parameter
from runtime.vehicle import Vehicle
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.value_reader import convert_to_unit_of
from support.terminal_text import with_suggestion
from tasks.simulators.battery import Battery

CONSOLE = 0x4001
"""The system in whose name a scenario sends messages: one of the consoles."""

EndAction = Callable[[], object]


@dataclass(frozen=True)
class Action(ABC):
    """Effect of an event on the vehicle of this name. `begin` may return the function that ends it."""

    vehicle: str

    def check(self, context: RunContext) -> None:  # noqa: B027, most have nothing to prepare
        """Prepare it, before the vehicles start. Raises ValueError if the vehicle cannot do it."""

    @abstractmethod
    def begin(self, context: RunContext, duration: float) -> EndAction | None:
        """Do it, for so many seconds if that is finite; the caller ends it then."""


@dataclass(frozen=True)
class InjectFault(Action):
    """A fault of a task, which logs itself."""

    task: str
    fault: Fault
    where: str = ""

    def check(self, context: RunContext) -> None:
        context.faults(self.vehicle).prepare_fault(self.task, self.fault)

    def begin(self, context: RunContext, duration: float) -> None:
        context.faults(self.vehicle).begin(self.task, self.fault, duration, self.where)


@dataclass(frozen=True)
class SimulateLeak(Action):
    """Leak sensors are wet: the one with this label, or all."""

    sensor: str

    def check(self, context: RunContext) -> None:
        labels = self._labels(context)
        if not labels:
            raise ValueError(f"{self.vehicle} has no simulated leak sensor")
        if self.sensor and self.sensor not in labels:
            raise ValueError(with_suggestion(f"there is no leak sensor {self.sensor!r}", self.sensor, labels))

    def begin(self, context: RunContext, duration: float) -> EndAction:
        vehicle, what = context.vehicles[self.vehicle], f"leak of {self.sensor or 'all sensors'}"
        log_action(vehicle, what, duration)
        deliver_message(vehicle, imc.LeakSimulation(op=imc.LeakSimulation.Op.ON, entities=self.sensor))
        sensors, holder = [self.sensor] if self.sensor else self._labels(context), object()
        for sensor in sensors:
            context.temporary_values.hold_value((self.vehicle, SimulateLeak, sensor), holder, "wet", "")

        def end() -> None:
            log_action(vehicle, f"end of the {what}")
            dry = [
                sensor
                for sensor in sensors
                if not context.temporary_values.release_value((self.vehicle, SimulateLeak, sensor), holder)
            ]
            if dry:
                deliver_message(vehicle, imc.LeakSimulation(op=imc.LeakSimulation.Op.OFF, entities=",".join(dry)))

        return end

    def _labels(self, context: RunContext) -> list[str]:
        return [label for task in context.vehicles[self.vehicle].tasks for label in getattr(task, "leak_entities", ())]


@dataclass(frozen=True)
class DrainBattery(Action):
    """The battery has this level (%), unless it has less."""

    level: float
    where: str = ""

    def check(self, context: RunContext) -> None:
        if not self._batteries(context):
            raise ValueError(f"{self.vehicle} has no simulated battery")

    def begin(self, context: RunContext, duration: float) -> None:
        words = f"battery drained to {self.level:g} %"
        if not any([battery.discharge_to(self.level) for battery in self._batteries(context)]):
            words = f"battery not drained to {self.level:g} %: it has less"
            context.warnings.append(f"{self.where}: {words}")
        log_action(context.vehicles[self.vehicle], words)

    def _batteries(self, context: RunContext) -> list[Battery]:
        return [task for task in context.vehicles[self.vehicle].tasks if isinstance(task, Battery)]


@dataclass(frozen=True)
class SetParameters(Action):
    """Parameters have other values, by section or label of a task and name; at the end, those that they had before.

    Of several such events the latest counts.
    """

    values: Mapping[str, Mapping[str, str]]

    def check(self, context: RunContext) -> None:
        for name, options in self.values.items():
            task = self._task(context.vehicles[self.vehicle], name)
            for option, text in options.items():
                parameter = self._parameter(task, option)
                if not parameter.editable:
                    raise ValueError(f"{task.name}: {option} cannot be changed while the vehicle runs")
                try:
                    parameter.parse_strict(convert_to_unit_of(parameter, text))
                except ValueError as error:
                    raise ValueError(f"{task.name}: {option}: {error}") from None

    def begin(self, context: RunContext, duration: float) -> EndAction:
        vehicle, holder, places = context.vehicles[self.vehicle], object(), dict[str, dict[str, Hashable]]()
        for name, options in self.values.items():
            task = self._task(vehicle, name)
            places[name], texts = {}, dict[str, str]()
            for option, given in options.items():
                parameter = self._parameter(task, option)
                text = texts[option] = convert_to_unit_of(parameter, given)
                place = places[name][parameter.name] = self.vehicle, task.name, parameter.name
                context.temporary_values.hold_value(
                    place, holder, text, parameter.format(task.parameter_set.value(parameter))
                )
            self._put(vehicle, task, texts, duration)

        def end() -> None:
            for name, options in places.items():
                left = {
                    option: context.temporary_values.release_value(place, holder) for option, place in options.items()
                }
                self._put(vehicle, self._task(vehicle, name), left)

        return end

    def _put(self, vehicle: Vehicle, task: Task, options: Mapping[str, str], duration: float = math.inf) -> None:
        words = ", ".join(f"{option} = {text}" for option, text in options.items())
        log_action(vehicle, f"{task.name}: {words}", duration)
        values = tuple(imc.EntityParameter(name=option, value=text) for option, text in options.items())
        deliver_message(vehicle, imc.SetEntityParameters(name=task.entity.label, params=values))

    def _task(self, vehicle: Vehicle, name: str) -> Task:
        tasks = {task.name: task for task in vehicle.tasks}
        found = tasks.get(name) or vehicle.task_by_label(name)
        if found is None:
            labels = [task.entity.label for task in vehicle.tasks]
            raise ValueError(with_suggestion(f"there is no task {name!r}", name, [*tasks, *labels]))
        return found

    def _parameter(self, task: Task, option: str) -> Parameter:
        declarations = task.parameter_set.declarations
        found = find_parameter(declarations, option)
        if found is None:
            raise ValueError(with_suggestion(f"{task.name} has no parameter {option!r}", option, declarations))
        return found


@dataclass(frozen=True)
class SendMessage(Action):
    """A message arrives, or is published by the vehicle if its source is the vehicle's own.

    `source` is the name of a system, `source_entity` and `target_entity` are labels of entities; each replaces the
    number in the header of the message, if it is not empty.
    """

    message: imc.Message
    description: str
    source: str = ""
    source_entity: str = ""
    target_entity: str = ""

    def check(self, context: RunContext) -> None:
        self._addressed(context)

    def begin(self, context: RunContext, duration: float) -> None:
        vehicle = context.vehicles[self.vehicle]
        log_action(vehicle, self.description)
        deliver_message(vehicle, self._addressed(context))

    def _addressed(self, context: RunContext) -> imc.Message:
        vehicle, message = context.vehicles[self.vehicle], self.message
        if self.source:
            number = vehicle.systems.id(self.source)
            if number is None:
                raise ValueError(f"there is no system {self.source!r} in [IMC Addresses] of {self.vehicle}")
            message = message.replace(src=number)
        for name, label in (("src_ent", self.source_entity), ("dst_ent", self.target_entity)):
            if not label:
                continue
            entity = vehicle.entities.find(label)
            if entity is None:
                labels = [entity.label for entity in vehicle.entities]
                raise ValueError(
                    with_suggestion(f"{self.vehicle} has no entity with the label {label!r}", label, labels)
                )
            message = message.replace(**{name: entity.id})
        return message


@dataclass(frozen=True)
class CutLink(Action):
    """Cuts a link: nothing passes it."""

    link: str

    def begin(self, context: RunContext, duration: float) -> EndAction:
        channel = context.channels[self.link]
        channel.cuts += 1
        for end in channel.ends:
            log_action(end.vehicle, f"link {self.link} cut", duration)

        def mend() -> None:
            channel.cuts -= 1
            for end in channel.ends:
                log_action(end.vehicle, f"link {self.link} mended")

        return mend


def log_action(vehicle: Vehicle, words: str, duration: float = math.inf) -> None:
    """Write to the log book of a vehicle what a scenario does to it."""
    vehicle.daemon.log.warning(f"scenario: {words}" + (f", for {duration:g} s" if math.isfinite(duration) else ""))


def deliver_message(vehicle: Vehicle, message: imc.Message) -> None:
    """Let a message arrive at a vehicle, by default from a console, and for this vehicle."""
    source = CONSOLE if message.src == UNKNOWN_SYSTEM else message.src
    target = vehicle.system if message.dst == UNKNOWN_SYSTEM and source != vehicle.system else message.dst
    time = vehicle.daemon.now
    packet = imc.encode_with_header(message, time, source, message.src_ent, target, message.dst_ent)
    arriving = vehicle.bus.decode(packet)
    if source == vehicle.system:
        vehicle.bus.deliver_and_send(arriving, packet, None)
    else:
        vehicle.bus.deliver(arriving, packet)
