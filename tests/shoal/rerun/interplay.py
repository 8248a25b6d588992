"""Tasks whose messages depend on everything received and drawn before, and its order."""

from zlib import crc32

import imc
from runtime import Task, consume, param, periodic


class Mixer(Task):
    """Publishes a digest of all received messages, at rates and delays that coincide with those of others."""

    rate: float = param(20.0, "Hz", "Rate of its own messages.", minimum=0.0)
    delay: float = param(0.0, "s", "What it hears is answered after so much time.", minimum=0.0)
    latency: float = param(0.0, "s", "Of its heavy work.", minimum=0.0)
    answers: int = param(3, "1", "Every so manieth message that is heard is answered.", minimum=1)

    def start(self) -> None:
        self.digest = self.heard = 0
        self.publish(imc.Rpm(value=-1))

    def stop(self) -> None:
        self.publish(imc.Rpm(value=-2))

    @consume
    def hear(self, message: imc.Rpm | imc.Voltage | imc.Temperature | imc.Heartbeat) -> None:
        self._mix(f"{message.src_ent} {message!r} {self.now_ns % 1000000}")
        self.heard += 1
        if isinstance(message, imc.Rpm) and self.heard % self.answers == 0:
            if self.delay:
                self.after(self.delay, self._answer)
            else:
                self._answer()

    @periodic("rate")
    def tick(self) -> None:
        self._mix(f"tick {self.now_ns}")
        self.publish(imc.Rpm(value=self.digest % 30000))
        if self.latency:
            self.offload(len, str(self.digest), then=self._worked, latency=self.latency)

    def _answer(self) -> None:
        self.publish(imc.Voltage(value=float(self.digest % 1000) + self.random.random()))

    def _worked(self, size: int) -> None:
        self.publish(imc.Temperature(value=float(size + self.digest % 100)))

    def _mix(self, text: str) -> None:
        self.digest = crc32(f"{self.digest} {text}".encode())
