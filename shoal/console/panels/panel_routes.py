"""Requests of the page for panels of the user, and orders of their buttons."""

from collections.abc import Mapping

from starlette.requests import Request
from starlette.responses import Response

from shoal.console.json_request import json_response
from shoal.console.panels.user_panels import UserPanel, find_button
from shoal.console.vehicle_orders import OrderError
from shoal.network import AsyncRemoteVehicle


class PanelRoutes:
    """Answers about panels, and sends the messages of their buttons."""

    def __init__(self, panels: tuple[UserPanel, ...]) -> None:
        self._panels = panels

    async def panels(self, _: Request) -> Response:
        """All panels."""
        return json_response({"ok": True, "panels": [panel.view() for panel in self._panels]})

    async def carry_out(self, user: str, vehicle: AsyncRemoteVehicle, order: str, words: Mapping[str, object]) -> str:
        """Send the message of a button once. Raises OrderError if there is no such button, NetworkError."""
        button = find_button(self._panels, {**words, "order": order, "vehicle": vehicle.system.name})
        if button is None:
            raise OrderError("this page has no such button for this vehicle")
        await vehicle.send(button.message)
        return f"{button.label}: {type(button.message).__name__} was sent; only what the vehicle does confirms it"
