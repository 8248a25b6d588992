"""Frames that wait for a viewer: answers in their order, and messages, of which a slow viewer loses the oldest."""

import asyncio
from collections import deque

MOST_MESSAGES = 2048
MOST_BYTES = 8 << 20
MOST_ANSWERS = 1024
MOST_ANSWER_BYTES = 64 << 20  # all channels with their types are less


class ViewerQueue:
    """Frames for one viewer. `dropped` counts the messages that were too many for it.

    Answers go before messages. `is_overrun`: a viewer that does not even take its answers is to be disconnected.
    """

    def __init__(self) -> None:
        self.dropped: int = 0
        self.is_overrun: bool = False
        self._answers: deque[str | bytes] = deque()
        self._messages: deque[bytes] = deque()
        self._size = self._answer_size = 0
        self._news = asyncio.Event()

    def put_answer(self, frame: str | bytes) -> None:
        if len(self._answers) >= MOST_ANSWERS or self._answer_size + len(frame) > MOST_ANSWER_BYTES:
            self.is_overrun = True
        else:
            self._answers.append(frame)
            self._answer_size += len(frame)
        self._news.set()

    def put_message(self, frame: bytes) -> None:
        self._messages.append(frame)
        self._size += len(frame)
        while len(self._messages) > MOST_MESSAGES or (self._size > MOST_BYTES and len(self._messages) > 1):
            self._size -= len(self._messages.popleft())
            self.dropped += 1
        self._news.set()

    async def next(self) -> str | bytes | None:
        """The next frame; None if the viewer is overrun."""
        while not self.is_overrun:
            if self._answers:
                answer = self._answers.popleft()
                self._answer_size -= len(answer)
                return answer
            if self._messages:
                frame = self._messages.popleft()
                self._size -= len(frame)
                return frame
            self._news.clear()
            await self._news.wait()
        return None
