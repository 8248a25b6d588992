"""The tasks that publish and consume each topic."""

from collections.abc import Iterable, Mapping
from functools import lru_cache

import imc
from runtime.task import consumer_methods
from runtime.vehicle import TaskImportError, find_task, task_modules
from shoal.network import NetworkSystem

Graph = dict[str, frozenset[str]]


def published_topics(
    publishers: Iterable[tuple[str, int, str]], systems: Mapping[str, NetworkSystem]
) -> tuple[Graph, Graph]:
    """The tasks that publish each topic, and those that consume it, each as VEHICLE/TASK.

    publishers: system, entity and topic of each channel. A task that is unknown here has the label of its entity; what
    it consumes is unknown.
    """
    published: dict[str, set[str]] = {}
    consumed: dict[str, set[str]] = {}
    consumers = {name: _consumers(system) for name, system in systems.items()}
    tasks = {name: _tasks(system) for name, system in systems.items()}
    for name, entity, topic in publishers:
        system = systems.get(name)
        if system is None:
            continue
        who = tasks[name].get(entity) or system.label(entity)
        published.setdefault(topic, set()).add(f"{name}/{who}")
        parts = topic.split("/")
        if len(parts) == 4:
            consumed.setdefault(topic, set()).update(f"{name}/{task}" for task in consumers[name].get(parts[2], ()))
    return _frozen(published), _frozen({topic: found for topic, found in consumed.items() if found})


def _frozen(graph: Mapping[str, Iterable[str]]) -> Graph:
    return {name: frozenset(found) for name, found in graph.items()}


def task_names(system: NetworkSystem) -> set[str]:
    """The tasks that have reported themselves."""
    return set(_tasks(system).values())


def _tasks(system: NetworkSystem) -> dict[int, str]:
    """The task of each entity that has reported it."""
    return {info.src_ent: info.component for info in system.latest_entity_messages(imc.EntityInfo) if info.component}


def _consumers(system: NetworkSystem) -> dict[str, set[str]]:
    """The tasks that consume each message, as this version of Shoal declares them; none of other programs."""
    found: dict[str, set[str]] = {}
    if not system.is_shoal:
        return found
    for task in task_names(system):
        for message in consumed_messages(task):
            found.setdefault(message, set()).add(task)
    return found


@lru_cache(4096)
def consumed_messages(task: str) -> frozenset[str]:
    """The messages that a task consumes, by the name of its section; none if there is no such task here.

    A name from the network leads to no other module.
    """
    section = task.partition("/")[0]
    if section.lower() not in task_modules():
        return frozenset()
    try:
        cls = find_task(section)
    except TaskImportError:
        return frozenset()
    return frozenset() if cls is None else frozenset(each.type.__name__ for each in consumer_methods(cls))
