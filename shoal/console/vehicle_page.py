"""The page of one vehicle, served by the process that runs it."""

import asyncio
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from shoal.console.access.page_security import access_folder, read_page_security
from shoal.console.access.users import User
from shoal.console.bus_link import BusLink
from shoal.console.charts.tiles import TileSets
from shoal.console.health.bus_counter import BusCounter
from shoal.console.panels.user_panels import PanelFileError, UserPanel, read_panels
from shoal.console.parameters.profile_settings import ProfileSettings
from shoal.console.server import ConsoleServer
from shoal.network import Network
from support.file_errors import describe_os_error
from tasks.transports.console import Console, PageServer


class VehiclePage(PageServer):
    """Serves a vehicle's page at a socket, over the bus of the vehicle; `show` gets the address to open.

    `settings` are those of its profile. Raises ValueError if the address of the task needs users or a certificate that
    are not there, OSError.
    """

    def __init__(
        self,
        task: Console,
        listener: socket.socket,
        show: Callable[[str], object],
        settings: ProfileSettings | None = None,
    ) -> None:
        folder = Path(task.access_folder) if task.access_folder else access_folder()
        security = read_page_security(task.address, folder)
        tiles = TileSets(Path(task.map_tiles) if task.map_tiles else None)

        def refusal(user: User) -> str:
            if task.commanders.allows_page_user(user.name):
                return ""
            return f"{user.name} may not command: page:{user.name} is not in [General] Consoles"

        link = BusLink(task)
        self._network = Network([link], messages=task.vehicle.bus.messages)
        self._server = ConsoleServer(
            self._network,
            tiles=tiles,
            security=security,
            listener=listener,
            journal=lambda _, text: task.note(text),
            refusal=refusal,
            on_viewer=link.wake,
            log_root=task.vehicle.log_root / task.system_name,
            settings=settings,
            counter=BusCounter(task),
            allows_forecasts=task.forecast,
            panels=panels_of(task),
        )
        link.is_watched = lambda: self._server.is_watched
        self.is_secure: bool = security.is_open
        self._stopped = asyncio.Event()
        link.on_end = self._stopped.set
        self._loop: asyncio.AbstractEventLoop | None = None
        self._has_ended = False
        for trouble in self._server.troubles:
            task.log.warning(trouble)
        show(self._server.login_link())

    @property
    def rejected_connections(self) -> int:
        return self._server.rejected_connections

    def run(self) -> None:
        asyncio.run(self._serve())

    def stop(self) -> None:
        self._has_ended = True
        if self._loop is not None:
            with suppress(RuntimeError):  # it has ended already
                self._loop.call_soon_threadsafe(self._stopped.set)

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        if self._has_ended:
            self._stopped.set()
        async with self._network:
            await self._server.serve(self._stopped)


def panels_of(task: Console) -> tuple[UserPanel, ...]:
    """The panels of the user; a file that cannot be read is a warning, and the page is served without."""
    if not task.panels:
        return ()
    try:
        return read_panels(Path(task.panels), task.vehicle.bus.messages)
    except (PanelFileError, OSError) as error:
        text = describe_os_error(error) if isinstance(error, OSError) else str(error)
        task.log.warning(f"there are no panels on the page: {text}")
        return ()
