"""Requests of the page about its user: login, logout, who I am, and the lease of a vehicle."""

from collections.abc import Callable

from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from shoal.console.access.authority import Authority, AuthorityError
from shoal.console.access.page_sessions import NO_CERTIFICATE, Access, LoginError, PageSession, ShownCertificate
from shoal.console.connections.page_protocol import CLIENT_CERTIFICATE
from shoal.console.json_request import json_object
from support.terminal_text import printable

MOST_LOGIN = 4096  # bytes: anybody may send one


class AccountRoutes:
    """The routes; `cookie` is the name of the cookie with the secret of a session.

    `has_vehicle(vehicle)` is whether there is a vehicle of this name.
    """

    def __init__(self, access: Access, authority: Authority, cookie: str, has_vehicle: Callable[[str], bool]) -> None:
        self._access, self._authority, self._cookie, self._has_vehicle = access, authority, cookie, has_vehicle
        self.routes: list[Route] = [
            Route("/api/login", self._login, methods=["POST"]),
            Route("/api/logout", self._logout, methods=["POST"]),
            Route("/api/me", self._me),
            Route("/api/lease", self._lease, methods=["POST"]),
        ]

    def session(self, request: HTTPConnection) -> PageSession | None:
        """The session of a request."""
        return self._access.session(request.cookies.get(self._cookie))

    async def _login(self, request: Request) -> Response:
        if int(request.headers.get("content-length", "0")) > MOST_LOGIN:
            return PlainTextResponse(f"a login has at most {MOST_LOGIN} bytes", 413)
        words, address = await json_object(request), request.client.host if request.client else ""
        try:
            if "token" in words:
                secret = self._access.login(words["token"], address)
            elif words.get("certificate") is True:
                secret = self._access.login_certificate(_certificate(request), address)
            else:
                secret = await self._access.login_user(words.get("user"), words.get("password"), address)
        except LoginError as error:
            return PlainTextResponse(str(error), 403)
        response = JSONResponse({"ok": True})
        response.set_cookie(
            self._cookie, secret, httponly=True, samesite="strict", secure=request.url.scheme == "https"
        )
        return response

    async def _logout(self, request: Request) -> Response:
        session = self.session(request)
        if session is not None:
            self._access.logout(request.cookies.get(self._cookie))
            self._authority.leases.leave(session.number)
        response = JSONResponse({"ok": True})
        response.delete_cookie(self._cookie)
        return response

    async def _me(self, request: Request) -> Response:
        session = self.session(request)
        if session is None:
            shown = self._access.certificate_user(_certificate(request))
            named = {} if shown is None else {"certificate": shown.name}
            return JSONResponse({"ok": False, "passwords": self._access.has_users, **named})
        user = session.user
        return JSONResponse({"ok": True, "session": session.number, "user": user.name, "role": user.role.word})

    async def _lease(self, request: Request) -> Response:
        session = self.session(request)
        if session is None:
            return PlainTextResponse("log in first", 401)
        words = await json_object(request)
        vehicle = words.get("vehicle")
        if not isinstance(vehicle, str) or not self._has_vehicle(vehicle):
            return JSONResponse({"ok": False, "text": "there is no such vehicle"})
        try:
            text = self._authority.change_lease(session, vehicle, words.get("change"))
        except AuthorityError as error:
            return JSONResponse({"ok": False, "text": printable(str(error))})
        return JSONResponse({"ok": True, "text": printable(text)})


def _certificate(request: Request) -> ShownCertificate:
    """The certificate that the client has shown."""
    found: ShownCertificate = request.scope.get("state", {}).get(CLIENT_CERTIFICATE, NO_CERTIFICATE)
    return found
