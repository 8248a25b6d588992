"""The page that a running vehicle serves itself."""

import socket

import click

from runtime.vehicle import Vehicle
from tasks.transports.console import Console, PageServer


def serve_page(vehicle: Vehicle) -> None:
    """Let the vehicle's task `Transports.Console` serve the page, and print the address to open, when it starts."""
    tasks = [task for task in vehicle.tasks if isinstance(task, Console)]
    if not tasks:
        return
    from shoal.console import (
        ProfileSettings,
        VehiclePage,
    )  # a web server, which a virtual run needs not; it takes a while

    settings = ProfileSettings(vehicle)

    def make_page(task: Console, listener: socket.socket) -> PageServer:
        return VehiclePage(task, listener, lambda address: click.echo(f"open {address}"), settings)

    for task in tasks:
        task.make_page = make_page
