"""A zenoh program without Shoal: `router PORT` forwards, `staller PORT MODE` takes a sample and stalls for 10 s."""

import json
import sys
import time
from typing import Any

import zenoh

STALL = 10.0  # s


def main() -> None:
    kind, port, *mode = sys.argv[1:]
    config: Any = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode[0] if mode else kind))
    config.insert_json5("scouting/multicast/enabled", "false")
    side = "listen" if kind == "router" else "connect"
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5(f"{side}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    stalls = iter([STALL])

    def take(_: zenoh.Sample) -> None:
        if seconds := next(stalls, 0.0):
            print(json.dumps({"stalls": seconds}), flush=True)
            time.sleep(seconds)
            print(json.dumps({"stalls": 0}), flush=True)

    with zenoh.open(config) as session:
        print(json.dumps({"opened": True}), flush=True)
        if kind == "staller":
            kept: Any = [session.declare_subscriber(key, take) for key in ("imc/**", "imc/*/@cmd/**")]
        sys.stdin.read()
        kept = None
        _ = kept


main()
