"""Ports of tasks that listen on the network: the first that is free, the report of it, and the retry without one."""

import socket
from collections.abc import Callable
from typing import NamedTuple

import imc
from imc.discovery import Service
from runtime import State, Task
from runtime.network_interfaces import is_loopback_address
from support.file_errors import describe_os_error
from support.log_limit import Trouble
from tasks.transports.imc_links.own_announce import EXTERNAL, LOCAL

RETRY = 5.0  # s


class OpenedServer(NamedTuple):
    """A server that listens: its loop for a thread of its own, its service, and the configured port.

    `risk` is what anybody who reaches the address may do, if it is open.
    """

    run: Callable[[], object]
    service: Service
    wanted_port: int
    risk: str = ""


def candidate_ports(first: int, tries: int) -> list[int]:
    """The ports to try, in order: some from the first on, then 0, which is any. A first one of 0 is any at once."""
    return [*range(first, min(first + tries, 65536)), 0] if first else [0]


def listening_socket(address: str, first: int, tries: int) -> socket.socket:
    """A TCP socket that listens at the first free one of `candidate_ports`. Raises OSError."""
    for port in candidate_ports(first, tries):
        opened = socket.socket()
        try:
            opened.setblocking(False)
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # connections of an earlier run may linger
            opened.bind((address, port))
            opened.listen()
            return opened
        except OSError as error:
            opened.close()
            if port == 0:
                raise OSError(error.errno, error.strerror, f"{address}:{first}") from None
    raise AssertionError("port 0 is tried last")


def start_server(
    task: Task, open_server: Callable[[], OpenedServer], started: Callable[[], object], trouble: Trouble | None = None
) -> None:
    """Open a server, run it in a thread of the task and announce it; then call `started`.

    If `open_server` raises OSError, or ValueError with a reason, the entity is in ERROR, the reason is logged unless it
    is that of the last attempt, in `trouble`, and it is tried again after 5 s.
    """
    trouble = trouble or Trouble()
    try:
        server = open_server()
    except (OSError, ValueError) as error:
        reason = describe_os_error(error) if isinstance(error, OSError) else str(error)
        trouble.report(reason, task.log.error)
        task.set_entity_state(State.ERROR, reason)
        task.after(RETRY, start_server, task, open_server, started, trouble)
        return
    task.run_in_thread(server.run)
    announce_listening_service(task, server.service, server.wanted_port, server.risk)
    started()


def announce_listening_service(
    task: Task, service: Service, wanted: int, risk: str = "", *, announced: bool = True
) -> None:
    """Report where a task listens: a port other than the configured one, and the risk if it is open. Announce it."""
    local = is_loopback_address(service.address)
    if risk and not local:
        task.log.warning(f"listens at {service.address}:{service.port} without passwords: {risk}")
    if wanted not in (0, service.port):
        task.log.info(f"port {wanted} is taken: listens at {service.port}")
    if announced:
        where = LOCAL if local else LOCAL | EXTERNAL
        task.publish(imc.AnnounceService(service=str(service), service_type=where))
