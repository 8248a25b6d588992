"""Consoles that may command a vehicle, as [General] Consoles of its profile lists them."""

from collections.abc import Sequence

from imc.console_acl import ConsoleAcl
from runtime.profile.config import split_list
from runtime.task import ParameterError, Task


def listed_consoles(task: Task, own: Sequence[str] = ()) -> ConsoleAcl:
    """Consoles that may command the vehicle of a task: its own list, or if this is empty that of [General].

    Raises ParameterError.
    """
    listed = own if any(map(str.strip, own)) else split_list(task.vehicle.profile.value("General", "Consoles", ""))
    try:
        return ConsoleAcl(listed, task.vehicle.systems.id)
    except ValueError as error:
        raise ParameterError("Consoles", str(error)) from None
