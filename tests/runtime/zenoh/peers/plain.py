"""A subscriber with only zenoh-python and imcpy, without Shoal: prints key and message of what it receives.

Arguments: key expression, mode, local port, scouting port.
"""

import json
import sys

import imcpy
import zenoh


def main() -> None:
    expression, mode, local_port, scouting_port = sys.argv[1:5]
    config = zenoh.Config()
    if mode == "client":
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{local_port}"]))
    config.insert_json5("scouting/multicast/address", json.dumps(f"224.0.0.224:{scouting_port}"))
    with zenoh.open(config) as session, session.declare_subscriber(expression) as subscriber:
        print(json.dumps({"opened": True}), flush=True)
        for sample in subscriber:
            message = imcpy.Packet.deserialize(sample.payload.to_bytes())
            told = {
                "key": str(sample.key_expr),
                "encoding": str(sample.encoding),
                "priority": str(sample.priority).removeprefix("Priority."),
                "abbrev": message.msg_name,
                "src": message.src,
                "x": getattr(message, "x", None),
                "label": getattr(message, "label", None),
            }
            print(json.dumps(told), flush=True)


main()
