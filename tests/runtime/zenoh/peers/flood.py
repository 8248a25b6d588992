"""A zenoh client without Shoal's transport that publishes packets fast, as anybody on the computer can.

Arguments: local port, kind of packet, packets per second, seconds. Prints how many it has sent.
"""

import json
import sys
import time
from typing import Any

import zenoh

import imc

VEHICLE, CONSOLE, NAME = 0x001A, 0x4001, "lauv-noptilus-1"


def packets(kind: str) -> list[tuple[str, bytes]]:
    """Keys and packets, sent in turn."""
    state, query = imc.EstimatedState, imc.QueryEntityInfo
    now = time.time()
    match kind:
        case "state in the vehicle's name":
            made = [(f"imc/{NAME}/EstimatedState/Navigation", state(src=VEHICLE, src_ent=e, x=9e3)) for e in range(200)]
        case "state of a console":
            made = [(f"imc/ccu/EstimatedState/{entity}", state(src=CONSOLE, src_ent=entity)) for entity in range(200)]
        case "states of many":
            made = [(f"imc/s{source}/EstimatedState/0", state(src=0x5000 + source)) for source in range(2000)]
        case "queries":
            made = [(f"imc/{NAME}/@cmd/QueryEntityInfo/ccu", query(src=CONSOLE, dst=VEHICLE, dst_ent=0xFF))]
        case "texts":
            made = [("imc/ccu/LogBookEntry/0", imc.LogBookEntry(src=CONSOLE, text="x" * 200, context="flood"))]
        case _:
            raise SystemExit(f"no such kind: {kind}")
    return [(key, imc.encode(message.replace(timestamp=now))) for key, message in made]


def main() -> None:
    port, kind, rate, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
    config: Any = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    made = packets(kind)
    with zenoh.open(config) as session:
        publishers = {key: session.declare_publisher(key) for key in dict(made[:300])}
        put = [(publishers[key].put if key in publishers else None, key, packet) for key, packet in made]
        print(json.dumps({"began": time.time()}), flush=True)
        began, sent = time.perf_counter(), 0
        while (passed := time.perf_counter() - began) < seconds:
            due = min(int(passed * rate), sent + 200)
            for number in range(sent, due):
                direct, key, packet = put[number % len(put)]
                if direct is not None:
                    direct(packet)
                else:
                    session.put(key, packet)
            sent = due
            time.sleep(0.001)
        print(json.dumps({"sent": sent, "ended": time.time()}), flush=True)


main()
