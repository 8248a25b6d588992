"""The routes of the page as its application has them, so that a new one is in each test of all routes."""

from starlette.routing import Route

from shoal.console import ConsoleServer


def routes_of(server: ConsoleServer) -> list[tuple[str, str]]:
    """Method and path of each route but those of WebSockets; HEAD is answered like GET."""
    routes = server._server.config.app._app._app.routes
    found = [(method, route.path) for route in routes if isinstance(route, Route) for method in route.methods or ()]
    return sorted(each for each in found if each[0] != "HEAD")
