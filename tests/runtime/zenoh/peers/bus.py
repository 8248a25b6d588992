"""A process with only a transport: sends EstimatedState with x counting up, and counts the messages it receives.

Arguments: system id, local port, scouting port (0 means none), options of [Zenoh] as JSON (or none). Commands on
standard input, one JSON answer each.
"""

import json
import logging
import sys
import threading
import time
from collections import Counter
from dataclasses import replace

import imc
from runtime.zenoh import ZenohConfig, ZenohTransport


class Process:
    def __init__(self, system: int, local_port: int, scouting_port: int, options: dict[str, str]) -> None:
        self.system = system
        self.heard: dict[int, list[float]] = {}
        self.names: Counter[str] = Counter()
        self.malformed = 0
        self.worst_send = self.worst_delay = 0.0
        self.sent = 0
        self.rate = 0.0
        self.listening = threading.Event()
        self.listening.set()
        scouting = {"Scouting": "loopback", "Scouting Address": f"224.0.0.224:{scouting_port}"}
        options = {"Local Port": str(local_port), **(scouting if scouting_port else {"Scouting": "none"}), **options}
        config = replace(ZenohConfig.from_options(options), vehicle=f"system-{system}")
        self.transport = ZenohTransport(config, lambda number: f"system-{number}", lambda system, entity: "Navigation")

    def receive(self, packet: bytes) -> None:
        self.listening.wait()
        try:
            message = imc.decode(packet)
        except imc.DecodeError:
            self.malformed += 1
            return
        self.names[type(message).__name__] += 1
        if isinstance(message, imc.PlanDB) and message.dst == self.system and message.type == imc.PlanDB.Type.REQUEST:
            done = {"type": imc.PlanDB.Type.SUCCESS, "request_id": message.request_id, "dst": message.src}
            self.publish(imc.PlanDB(src=self.system, timestamp=time.time(), **done))
        if isinstance(message, imc.EstimatedState):
            self.heard.setdefault(message.src, []).append(message.x)

    def publish(self, message: imc.Message) -> None:
        began = time.perf_counter()
        self.transport.send(message, imc.encode(message))
        self.worst_send = max(self.worst_send, time.perf_counter() - began)

    def flow(self) -> None:
        due = time.perf_counter()
        while True:
            if not self.rate:
                time.sleep(0.01)
                due = time.perf_counter()
                continue
            due += 1 / self.rate
            time.sleep(max(0.0, due - time.perf_counter()))
            self.worst_delay = max(self.worst_delay, time.perf_counter() - due)
            self.sent += 1
            self.publish(imc.EstimatedState(x=float(self.sent), timestamp=time.time(), src=self.system, src_ent=7))

    def status(self) -> dict[str, object]:
        transport = self.transport
        return {
            "heard": {src: [len(x), x[-1], x == sorted(set(x))] for src, x in self.heard.items()},
            "names": self.names,
            "malformed": self.malformed,
            "lost": transport.subscribers.lost.total,
            "oversize": transport.subscribers.oversize.total,
            "unsent": transport.unsent.total,
            "sent": self.sent,
            "worst_send": self.worst_send,
            "worst_delay": self.worst_delay,
        }

    def obey(self, word: str, *values: str) -> dict[str, object]:
        match word:
            case "flow":
                self.rate = float(values[0])
            case "reset":
                self.worst_send = self.worst_delay = 0.0
            case "deaf":
                self.listening.clear()
            case "hear":
                self.listening.set()
            case "send":
                fields = {"timestamp": time.time(), "src": self.system, "src_ent": 7, **json.loads(values[0])}
                self.publish(getattr(imc, fields.pop("abbrev"))(**fields))
            case "close":
                began = time.perf_counter()
                self.transport.close()
                return {"closed": time.perf_counter() - began}
            case _:
                pass
        return self.status()


def main() -> None:
    logging.basicConfig(stream=sys.stderr)
    system, local_port, scouting_port = map(int, sys.argv[1:4])
    process = Process(system, local_port, scouting_port, json.loads(sys.argv[4]) if sys.argv[4:] else {})
    process.transport.open(process.receive)
    threading.Thread(target=process.flow, daemon=True).start()
    print(json.dumps({"opened": True}), flush=True)
    for line in sys.stdin:
        answer = process.obey(*line.rstrip("\n").split(" ", 1))
        print(json.dumps(answer), flush=True)
        if "closed" in answer:
            return


main()
