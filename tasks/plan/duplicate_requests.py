"""Copies of requests: a console that got no answer sends the same packet again, and must not start a plan twice."""

import imc

MOST = 16


class DuplicateRequests:
    """The last requests of other systems, each with its last answer.

    A copy is equal to the last bit, and has a time stamp: a new request of the same kind has another one.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._answers: dict[int, tuple[imc.Message, imc.Message | None]] = {}
        self._count = 0

    def is_duplicate(self, request: imc.Message) -> bool:
        """Whether a request is a copy; else it is remembered from now on."""
        if request.src == self._system or request.timestamp <= 0.0:
            return False
        if self._place(request) is not None:
            return True
        self._count += 1
        self._answers[self._count] = request, None
        self._answers.pop(self._count - MOST, None)
        return False

    def remember_answer(self, request: imc.Message, answer: imc.Message) -> None:
        """Remember the answer to a request."""
        place = self._place(request)
        if place is not None:
            self._answers[place] = request, answer

    def last_answer(self, request: imc.Message) -> imc.Message | None:
        """The last answer to a request, None while there is none."""
        place = self._place(request)
        return None if place is None else self._answers[place][1]

    def _place(self, request: imc.Message) -> int | None:
        return next((place for place, (known, _) in self._answers.items() if known == request), None)
