"""Opens a zenoh session in a thread: an endpoint that does not answer takes long."""

import asyncio
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, cast

from runtime.zenoh import SessionFactory, ZenohConfig

if TYPE_CHECKING:
    from typing import Any

    import zenoh

LAST_TRY = 1.0  # s to wait for a connection that is being tried: most are made or refused at once


class ZenohSessionThread:
    """Opens sessions of a configuration, one after the other, without holding up the event loop."""

    def __init__(self, config: ZenohConfig) -> None:
        self._config = config
        self._factory = SessionFactory()
        self._thread: threading.Thread | None = None

    async def open(self) -> "zenoh.Session":
        """A session. Raises zenoh.ZError, and what else the configuration or the library raises."""
        loop = asyncio.get_running_loop()
        opened: asyncio.Future[zenoh.Session] = loop.create_future()

        def finish(session: "zenoh.Session | None", error: Exception | None) -> None:
            if opened.done():  # too late: the caller has given up
                if session is not None:
                    cast("Any", session).close()
            elif session is not None:
                opened.set_result(session)
            else:
                opened.set_exception(error or ConnectionError())

        def work() -> None:
            session: zenoh.Session | None = None
            error: Exception | None = None
            try:
                session = self._factory.open(self._config.build().config)
            except BaseException as trouble:  # a panic in Rust is no Exception; who waits would wait for ever
                error = trouble if isinstance(trouble, Exception) else ConnectionError(str(trouble))
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(finish, session, error)

        self._thread = threading.Thread(target=work, name="zenoh open", daemon=True)
        self._thread.start()
        return await opened

    async def close(self) -> None:
        """Wait for a moment until a session that is being opened is there, or has failed."""
        if self._thread is not None:  # Python would abort if it ended while this thread comes back from zenoh
            await asyncio.to_thread(self._thread.join, LAST_TRY)
        await asyncio.to_thread(self._factory.stop_link_timeout)
