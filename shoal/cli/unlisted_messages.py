"""Message types that a vehicle does not send to consoles over UDP or TCP, because its lists do not have them."""

from collections.abc import Sequence

import imc
from shoal.network import AsyncRemoteVehicle, NetworkError

TASKS = {"udp": "Transports.UDP", "tcp": "Transports.TCP.Server"}
LIST = "Transports"


async def unlisted_messages_text(vehicle: AsyncRemoteVehicle, kinds: Sequence[type[imc.Message]]) -> str:
    """Reason why none of these types comes, and the remedy; empty if the list of the vehicle's link has one of them.

    Only a Shoal vehicle is asked, and none over zenoh, which brings all messages.
    """
    system = vehicle.system
    carriers = [name for name in system.links if name in TASKS]
    if not kinds or not system.is_shoal or len(carriers) < len(system.links):
        return ""
    try:
        components = await vehicle.param.components(await vehicle.param.entity_ids())
        labels = [label for label, task in components.items() if task in {TASKS[name] for name in carriers}]
        lists = [(await vehicle.param.get(label)).get(LIST, "") for label in labels]
    except NetworkError:
        return ""
    listed = {item.partition(":")[0].strip() for text in lists for item in text.split(",")}
    names = [kind.__name__ for kind in kinds]
    if not lists or not listed.isdisjoint(names):
        return ""
    where = " and ".join(f"[{TASKS[name]}] {LIST}" for name in carriers)
    return f"{' and '.join(names)}: not in {where} of {vehicle.name}; add it there or to [General] Console Messages"
