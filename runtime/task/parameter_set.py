"""The parameters of one task: declarations, current values and pushed values."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from runtime.task.parameters import Parameter, Scope, Visibility, find_parameter

DEEPEST = 64  # pushes that are remembered; a system may push without end


@dataclass(slots=True)
class ParameterSet:
    """The parameters of one task instance: the values are attributes of the task."""

    owner: Any
    declarations: dict[str, Parameter]
    pushed: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=DEEPEST))

    def find(self, name: str) -> Parameter | None:
        """The parameter of this ini name or alias."""
        return find_parameter(self.declarations, name)

    def value(self, parameter: Parameter) -> Any:
        return getattr(self.owner, parameter.attribute)

    def text(self, parameter: Parameter) -> str:
        return parameter.format(self.value(parameter))

    def set(self, parameter: Parameter, value: Any) -> None:
        setattr(self.owner, parameter.attribute, value)

    def snapshot(self) -> dict[str, Any]:
        return {name: self.value(p) for name, p in self.declarations.items()}

    def restore(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            self.set(self.declarations[name], value)

    def redeclare(self, name: str, attributes: Mapping[str, str]) -> None:
        """Take scope, visibility and editable from an ini file; invalid values are ignored."""
        parameter = self.find(name)
        if parameter is None:
            return
        changes: dict[str, Any] = {}
        if attributes.get("scope") in get_args(Scope):
            changes["scope"] = attributes["scope"]
        if attributes.get("visibility") in get_args(Visibility):
            changes["visibility"] = attributes["visibility"]
        if attributes.get("editable") in ("true", "false"):
            changes["editable"] = attributes["editable"] == "true"
        self.declarations[parameter.name] = replace(parameter, **changes)

    def push(self) -> None:
        """Remember the values whose scope is not global."""
        self.pushed.append({name: self.value(p) for name, p in self.declarations.items() if p.scope != "global"})

    def pop(self) -> bool:
        """Restore what `push` remembered last; False if there is nothing."""
        if not self.pushed:
            return False
        self.restore(self.pushed.pop())
        return True
