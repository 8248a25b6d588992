"""A zenoh program without Shoal's transport that asks, joins late, and watches who is alive.

Arguments: mode ("client" or "peer"), local port, scouting port, zenoh options as JSON (or none). Commands on standard
input, one JSON answer each: `get KEY [MESSAGE]`, `put KEY MESSAGE`, `token KEY`, `tokens EXPRESSION`,
`late EXPRESSION SECONDS`, `watch EXPRESSION` (then one line per birth and death).
"""

import contextlib
import json
import sys
import threading
import time
from typing import Any

import zenoh
import zenoh.ext

import imc

lock = threading.Lock()


def say(what: object) -> None:
    with lock:
        print(json.dumps(what), flush=True)


def shown(key: object, payload: bytes) -> dict[str, object]:
    message = imc.decode(payload)
    return {"key": str(key), "abbrev": type(message).__name__, "text": str(message), **header(message)}


def header(message: imc.Message) -> dict[str, object]:
    plain = {name: getattr(message, name, None) for name in ("src", "dst", "x", "list", "name", "op", "type", "info")}
    return {name: value for name, value in plain.items() if value is not None}


def made(fields: dict[str, Any]) -> imc.Message:
    kind: Any = getattr(imc, fields.pop("abbrev"))
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})


def message_of(text: str) -> bytes:
    return imc.encode(json.loads(text, object_hook=made).replace(timestamp=time.time()))


def get(session: Any, key: str, request: str = "") -> dict[str, object]:
    began = time.perf_counter()
    replies: list[object] = []
    errors: list[str] = []
    for reply in session.get(key, payload=message_of(request) if request else None, timeout=8.0):
        if reply.ok is not None:
            replies.append(shown(reply.ok.key_expr, reply.ok.payload.to_bytes()))
        else:
            errors.append(reply.err.payload.to_string())
    return {"replies": replies, "errors": errors, "seconds": time.perf_counter() - began}


def late(session: Any, expression: str, seconds: str) -> dict[str, object]:
    heard: list[object] = []
    began = time.perf_counter()
    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        expression,
        lambda sample: heard.append(
            {**shown(sample.key_expr, sample.payload.to_bytes()), "after": time.perf_counter() - began}
        ),
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
    )
    time.sleep(float(seconds))
    subscriber.undeclare()
    return {"heard": heard}


def main() -> None:
    mode, local_port, scouting_port, *options = sys.argv[1:]
    config: Any = zenoh.Config()
    if mode == "client":
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{local_port}"]))
    config.insert_json5("scouting/multicast/address", json.dumps(f"224.0.0.224:{scouting_port}"))
    for name, value in json.loads(options[0] if options else "{}").items():
        config.insert_json5(name, json.dumps(value))
    with contextlib.ExitStack() as stack:
        session: Any = stack.enter_context(zenoh.open(config))
        say({"opened": True})
        for line in sys.stdin:
            word, *values = line.rstrip("\n").split(" ", 2)
            match word:
                case "get":
                    say(get(session, *values))
                case "put":
                    session.put(values[0], message_of(values[1]), congestion_control=zenoh.CongestionControl.BLOCK)
                    say({"put": values[0]})
                case "token":
                    stack.enter_context(session.liveliness().declare_token(values[0]))
                    say({"token": values[0]})
                case "tokens":
                    replies = session.liveliness().get(values[0], timeout=2.0)
                    say({"tokens": [{"token": str(reply.ok.key_expr)} for reply in replies if reply.ok is not None]})
                case "late":
                    say(late(session, *values))
                case "watch":
                    say({"watching": values[0]})
                    stack.enter_context(
                        session.liveliness().declare_subscriber(
                            values[0],
                            lambda s: say({"token": str(s.key_expr), "born": s.kind == zenoh.SampleKind.PUT}),
                            history=True,
                        )
                    )
                case _:
                    raise SystemExit(f"no such command: {word}")


main()
