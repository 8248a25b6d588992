"""Requests that only ask, so that a vehicle may get several copies."""

import imc

_OPERATIONS: dict[type[imc.Message], frozenset[int]] = {
    imc.EntityList: frozenset({imc.EntityList.Op.QUERY}),
    imc.LblConfig: frozenset({imc.LblConfig.Op.GET_CFG}),
    imc.LogBookControl: frozenset({imc.LogBookControl.Command.GET, imc.LogBookControl.Command.GET_ERR}),
    imc.LoggingControl: frozenset({imc.LoggingControl.Op.REQUEST_CURRENT_NAME}),
    imc.PlanControl: frozenset({imc.PlanControl.Op.GET}),
    imc.PlanDB: frozenset(
        {imc.PlanDB.Op.GET, imc.PlanDB.Op.GET_INFO, imc.PlanDB.Op.GET_STATE, imc.PlanDB.Op.GET_DSTATE}
    ),
    imc.RemoteActionsRequest: frozenset({imc.RemoteActionsRequest.Op.QUERY}),
}
NAMES = ("Query", "Get")
"""Beginnings of the names of messages that only ask."""


def is_query(message: imc.Message) -> bool:
    """Whether a message only asks; one that is not known does not."""
    asks = _OPERATIONS.get(type(message))
    if asks is not None:
        return getattr(message, "op", getattr(message, "command", None)) in asks
    return type(message).__name__.startswith(NAMES)
