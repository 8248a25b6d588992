"""A link of a network that brings packets as a test wants."""

import imc
from shoal.network.link import ReceivedPacket


class Radio:
    """A link that only brings packets."""

    name, trouble, delivers_all = "radio", "", True
    discovery_timeout = 0.0
    fragment_size = 0

    async def open(self, listener, console):
        self.listener = listener

    def subscribe(self, system, messages):
        pass

    def unsubscribe(self, system, messages):
        pass

    def send(self, system, message, packet):
        pass

    async def close(self):
        pass

    def bring(self, *messages, system="lauv-noptilus-1"):
        for message in messages:
            self.listener.on_packet(self, ReceivedPacket(imc.encode(message), system))
