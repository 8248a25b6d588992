"""What events do to a vehicle; the log of the vehicle tells each of them."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass

import imc
from imc.addresses import UNKNOWN_SYSTEM
from runtime.fault_injection import Fault
from runtime.task import Parameter, Task, find_parameter
from runtime.vehicle import Vehicle
from shoal.scenarios.stage import Stage
from shoal.scenarios.values import in_unit_of
from support.text import with_suggestion
from tasks.simulators.battery import Battery

CONSOLE = 0x4001
"""The system in whose name a scenario sends messages: one of the consoles."""

End = Callable[[], object]


@dataclass(frozen=True)
class Act(ABC):
    """What an event does to the vehicle of this name. `begin` may return the function that ends it."""

    vehicle: str

    def check(self, stage: Stage) -> None:  # noqa: B027, most have nothing to prepare
        """Prepare it, before the vehicles start. Raises ValueError if the vehicle cannot do it."""

    @abstractmethod
    def begin(self, stage: Stage, lasting: float) -> End | None:
        """Do it, for so many seconds if that is finite; the caller ends it then."""


@dataclass(frozen=True)
class Break(Act):
    """A fault of a task, which logs itself."""

    task: str
    fault: Fault
    where: str = ""

    def check(self, stage: Stage) -> None:
        stage.faults(self.vehicle).prepare(self.task, self.fault)

    def begin(self, stage: Stage, lasting: float) -> None:
        stage.faults(self.vehicle).begin(self.task, self.fault, lasting, self.where)


@dataclass(frozen=True)
class Leak(Act):
    """Leak sensors are wet: the one with this label, or all."""

    sensor: str

    def check(self, stage: Stage) -> None:
        labels = self._labels(stage)
        if not labels:
            raise ValueError(f"{self.vehicle} has no simulated leak sensor")
        if self.sensor and self.sensor not in labels:
            raise ValueError(with_suggestion(f"there is no leak sensor {self.sensor!r}", self.sensor, labels))

    def begin(self, stage: Stage, lasting: float) -> End:
        vehicle, what = stage.vehicles[self.vehicle], f"leak of {self.sensor or 'all sensors'}"
        tell(vehicle, what, lasting)
        say(vehicle, imc.LeakSimulation(op=imc.LeakSimulation.Op.ON, entities=self.sensor))
        sensors, holder = [self.sensor] if self.sensor else self._labels(stage), object()
        for sensor in sensors:
            stage.overlaps.begin((self.vehicle, Leak, sensor), holder, "wet", "")

        def end() -> None:
            tell(vehicle, f"end of the {what}")
            dry = [sensor for sensor in sensors if not stage.overlaps.end((self.vehicle, Leak, sensor), holder)]
            if dry:
                say(vehicle, imc.LeakSimulation(op=imc.LeakSimulation.Op.OFF, entities=",".join(dry)))

        return end

    def _labels(self, stage: Stage) -> list[str]:
        return [label for task in stage.vehicles[self.vehicle].tasks for label in getattr(task, "leak_entities", ())]


@dataclass(frozen=True)
class Drain(Act):
    """The battery has this level (%), unless it has less."""

    level: float
    where: str = ""

    def check(self, stage: Stage) -> None:
        if not self._batteries(stage):
            raise ValueError(f"{self.vehicle} has no simulated battery")

    def begin(self, stage: Stage, lasting: float) -> None:
        words = f"battery drained to {self.level:g} %"
        if not any([battery.drain(self.level) for battery in self._batteries(stage)]):
            words = f"battery not drained to {self.level:g} %: it has less"
            stage.warnings.append(f"{self.where}: {words}")
        tell(stage.vehicles[self.vehicle], words)

    def _batteries(self, stage: Stage) -> list[Battery]:
        return [task for task in stage.vehicles[self.vehicle].tasks if isinstance(task, Battery)]


@dataclass(frozen=True)
class Set(Act):
    """Parameters have other values, by section or label of a task and name; at the end, those that they had before.

    Of several such events the latest counts.
    """

    values: Mapping[str, Mapping[str, str]]

    def check(self, stage: Stage) -> None:
        for name, options in self.values.items():
            task = self._task(stage.vehicles[self.vehicle], name)
            for option, text in options.items():
                parameter = self._parameter(task, option)
                if not parameter.editable:
                    raise ValueError(f"{task.name}: {option} cannot be changed while the vehicle runs")
                try:
                    parameter.parse_strict(in_unit_of(parameter, text))
                except ValueError as error:
                    raise ValueError(f"{task.name}: {option}: {error}") from None

    def begin(self, stage: Stage, lasting: float) -> End:
        vehicle, holder, places = stage.vehicles[self.vehicle], object(), dict[str, dict[str, Hashable]]()
        for name, options in self.values.items():
            task = self._task(vehicle, name)
            places[name], texts = {}, dict[str, str]()
            for option, given in options.items():
                parameter = self._parameter(task, option)
                text = texts[option] = in_unit_of(parameter, given)
                place = places[name][parameter.name] = self.vehicle, task.name, parameter.name
                stage.overlaps.begin(place, holder, text, parameter.format(task.parameter_set.value(parameter)))
            self._put(vehicle, task, texts, lasting)

        def end() -> None:
            for name, options in places.items():
                left = {option: stage.overlaps.end(place, holder) for option, place in options.items()}
                self._put(vehicle, self._task(vehicle, name), left)

        return end

    def _put(self, vehicle: Vehicle, task: Task, options: Mapping[str, str], lasting: float = math.inf) -> None:
        words = ", ".join(f"{option} = {text}" for option, text in options.items())
        tell(vehicle, f"{task.name}: {words}", lasting)
        values = tuple(imc.EntityParameter(name=option, value=text) for option, text in options.items())
        say(vehicle, imc.SetEntityParameters(name=task.entity.label, params=values))

    def _task(self, vehicle: Vehicle, name: str) -> Task:
        tasks = {task.name: task for task in vehicle.tasks}
        found = tasks.get(name) or vehicle.find(name)
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
class Say(Act):
    """A message arrives, or is published by the vehicle if its source is the vehicle's own.

    `source` is the name of a system, `speaker` and `hearer` are labels of entities; each replaces the number in the
    header of the message, if it is not empty.
    """

    message: imc.Message
    words: str
    source: str = ""
    speaker: str = ""
    hearer: str = ""

    def check(self, stage: Stage) -> None:
        self._addressed(stage)

    def begin(self, stage: Stage, lasting: float) -> None:
        vehicle = stage.vehicles[self.vehicle]
        tell(vehicle, self.words)
        say(vehicle, self._addressed(stage))

    def _addressed(self, stage: Stage) -> imc.Message:
        vehicle, message = stage.vehicles[self.vehicle], self.message
        if self.source:
            number = vehicle.systems.id(self.source)
            if number is None:
                raise ValueError(f"there is no system {self.source!r} in [IMC Addresses] of {self.vehicle}")
            message = message.replace(src=number)
        for name, label in (("src_ent", self.speaker), ("dst_ent", self.hearer)):
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
class Cut(Act):
    """Nothing passes a link."""

    link: str

    def begin(self, stage: Stage, lasting: float) -> End:
        channel = stage.channels[self.link]
        channel.cuts += 1
        for end in channel.ends:
            tell(end.vehicle, f"link {self.link} cut", lasting)

        def mend() -> None:
            channel.cuts -= 1
            for end in channel.ends:
                tell(end.vehicle, f"link {self.link} mended")

        return mend


def tell(vehicle: Vehicle, words: str, lasting: float = math.inf) -> None:
    """Have the log book of a vehicle say what a scenario does to it."""
    vehicle.daemon.log.warning(f"scenario: {words}" + (f", for {lasting:g} s" if math.isfinite(lasting) else ""))


def say(vehicle: Vehicle, message: imc.Message) -> None:
    """Let a message arrive at a vehicle, by default from a console, and for this vehicle."""
    source = CONSOLE if message.src == UNKNOWN_SYSTEM else message.src
    target = vehicle.system if message.dst == UNKNOWN_SYSTEM and source != vehicle.system else message.dst
    time = vehicle.daemon.now
    packet = imc.encode_as(message, time, source, message.src_ent, target, message.dst_ent)
    heard = vehicle.bus.decode(packet)
    if source == vehicle.system:
        vehicle.bus.publish(heard, packet, None)
    else:
        vehicle.bus.deliver(heard, packet)
