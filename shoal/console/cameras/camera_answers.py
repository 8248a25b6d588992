"""Answers to the page about the cameras of the vehicles: what there is, and each picture."""

from collections.abc import Mapping

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from shoal.console.cameras.live_pictures import LivePictures
from shoal.console.json_request import Answer, json_response, refusal_response
from shoal.console.page_part import PagePart
from shoal.network import Network, NetworkSystem
from support.number_parsing import natural_number


class CameraAnswers(PagePart):
    """Answers by path, from the pictures of a network. Without questions nothing is asked of the vehicles.

    A picture that has been replaced by a newer one is answered with 204.
    """

    def __init__(self, network: Network, pictures: LivePictures) -> None:
        self._network, self._pictures = network, pictures
        self.questions: Mapping[str, Answer] = {"/api/cameras": self._cameras, "/api/picture": self._picture}

    async def _cameras(self, request: Request) -> Response:
        system = self._system(request)
        if system is None:
            return refusal_response("there is no such vehicle", cameras=[])
        found = await self._pictures.describe(system, request.query_params.get("live", ""))
        return json_response({"ok": True, **found})

    async def _picture(self, request: Request) -> Response:
        system, number = self._system(request), natural_number(request.query_params.get("number", ""))
        if system is None or number is None:
            return PlainTextResponse("there is no such picture", 404)
        try:
            found = await self._pictures.picture(system, request.query_params.get("camera", ""), number)
        except ValueError as error:
            return PlainTextResponse(str(error), 422)
        if found is None:
            return Response(status_code=204)
        form, data = found
        return Response(data, media_type=f"image/{form}", headers={"Cache-Control": "no-store"})

    def _system(self, request: Request) -> NetworkSystem | None:
        system = self._network.systems.get(request.query_params.get("vehicle", ""))
        return system if system is not None and system.is_vehicle else None
