"""A zenoh session that publishes nonsense under imc/**, and one good packet at a wrong key. Argument: local port."""

import json
import sys
import time

import zenoh

import imc


def main() -> None:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{sys.argv[1]}"]))
    good = imc.encode(imc.EstimatedState(x=5.0, src=77, timestamp=time.time()))
    with zenoh.open(config) as session:
        nonsense = [
            ("imc/a/EstimatedState/b", b"nonsense"),
            ("imc/a", b""),
            ("imc/*/%2F/**", good[:-1]),
            ("imc/a/@cmd/b/c/d/e", good[:-1] + bytes([good[-1] ^ 1])),
            ("imc/a/EstimatedState/b", bytes(65536)),
            ("imc/a/EstimatedState/b", bytes(10_000_000)),
        ]
        block = zenoh.CongestionControl.BLOCK
        for key, payload in nonsense:
            session.put(key, payload, congestion_control=block)
        session.put("imc/é/ /**/x", good, congestion_control=block)
        print(json.dumps({"published": len(nonsense)}), flush=True)
        sys.stdin.read()


main()
