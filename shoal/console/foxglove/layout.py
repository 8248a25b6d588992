"""A layout of panels for the vehicles that are there, to be imported into Foxglove or Lichtblick."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import imc
from runtime.logs import label_text
from shoal.console.vehicle_view import position
from shoal.logs.export import ros_name
from shoal.network import NetworkSystem

Panels = dict[str, Any]


def make_layout(systems: Iterable[NetworkSystem]) -> Panels:
    """Map, scene, depths and speeds, log book, and parameters."""
    states = [(system, state) for system in systems if (state := system.latest_message(imc.EstimatedState))]
    topics = [_topic(system, state) for system, state in states]
    places = [found for _, state in states if all(map(math.isfinite, found := position(state)))]
    return {
        "configById": {
            "map!vehicles": _map(topics, places),
            "3D!vehicles": _scene(topics, [ros_name(system.name) for system, _ in states]),
            "Plot!depth": _plot("Depth (m)", [f"{topic}.depth" for topic in topics]),
            "Plot!speed": _plot("Speed ahead (m/s)", [f"{topic}.u" for topic in topics]),
            "RosOut!log": {"searchTerms": [], "minLogLevel": 2, "topicToRender": "/rosout"},
            "Parameters!all": {"title": "Parameters"},
        },
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "first": _column("map!vehicles", "3D!vehicles"),
            "second": _column(_column("Plot!depth", "Plot!speed"), _column("RosOut!log", "Parameters!all")),
            "splitPercentage": 50,
        },
    }


def _topic(system: NetworkSystem, state: imc.EstimatedState) -> str:
    label = label_text(system.labels.get(state.src_ent), state.src_ent)
    return "/".join(("", ros_name(system.name), "EstimatedState", ros_name(label)))


def _map(topics: Sequence[str], places: Sequence[tuple[float, float, float]]) -> Panels:
    lat, lon = map(math.degrees, places[0][:2]) if places else (0.0, 0.0)
    return {
        "center": {"lat": lat, "lon": lon},
        "zoomLevel": 15 if places else 2,
        "layer": "map",
        "customTileUrl": "",
        "disabledTopics": [],
        "followTopic": f"{topics[0]}/location" if topics else "",
    }


def _scene(topics: Sequence[str], frames: Sequence[str]) -> Panels:
    return {
        "followMode": "follow-position",
        "followTf": frames[0] if frames else "map",
        "topics": {f"{topic}/pose": {"visible": True, "type": "axis"} for topic in topics},
        "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "size": 1000, "divisions": 20}},
    }


def _plot(title: str, paths: Sequence[str]) -> Panels:
    return {
        "title": title,
        "paths": [{"value": path, "enabled": True, "timestampMethod": "receiveTime"} for path in paths],
        "xAxisVal": "timestamp",
        "followingViewWidth": 300,
        "showLegend": True,
        "isSynced": True,
    }


def _column(first: str | Panels, second: str | Panels) -> Panels:
    return {"direction": "column", "first": first, "second": second}
