"""Run in a network namespace of its own: a vehicle, a plain zenoh program beside it, and an attacker on its network.

The attacker is in a second namespace, at the other end of a cable (a veth pair). Argument: a folder. Prints one JSON
object: what the attacker could reach, and what the plain program received. A word before the folder is another scene.
`twins`: another vehicle of the same name there, and what it is told; `scouts`: and they find each other by multicast;
`cut`: another process of the vehicle there, and a cut cable.
"""

import contextlib
import json
import os
import queue
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

VEHICLE, ATTACKER = "10.99.0.1", "10.99.0.2"
NAME = "lauv-noptilus-1"
GROUP = "224.0.75.69"
PATIENCE = 20.0
CUT = 30.0  # s
WATCH = 3.0  # s; zenoh's own scouting asks at 0, 1, 3 s


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True)


def lines(process: subprocess.Popen[str]) -> "queue.Queue[str]":
    """The output of a process, read by a thread."""
    found: queue.Queue[str] = queue.Queue()
    stream = process.stdout
    assert stream is not None
    threading.Thread(target=lambda: [found.put(line) for line in stream], daemon=True).start()
    return found


def wait_for(found: "queue.Queue[str]", word: str) -> str:
    """The first line that contains a word."""
    seen: list[str] = []
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with contextlib.suppress(queue.Empty):
            seen.append(found.get(timeout=0.2))
            if word in seen[-1]:
                return seen[-1]
    raise AssertionError(f"no {word!r} in {seen}")


def sockets(kind: str, process: int) -> list[tuple[str, int, str, int]]:
    """Local address and port, and the other end's, of all sockets of a process."""
    inodes = {os.readlink(path)[8:-1] for path in Path(f"/proc/{process}/fd").iterdir() if path.is_symlink()}
    found: list[tuple[str, int, str, int]] = []
    for family, table in ((socket.AF_INET, kind), (socket.AF_INET6, f"{kind}6")):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            values = line.split()
            if values[9] not in inodes:
                continue
            ends = [end.split(":") for end in values[1:3]]
            words = [b"".join(struct.pack("=I", int(a[i : i + 8], 16)) for i in range(0, len(a), 8)) for a, _ in ends]
            here, there = (socket.inet_ntop(family, word) for word in words)
            found.append((here, int(ends[0][1], 16), there, int(ends[1][1], 16)))
    return found


def is_local(address: str) -> bool:
    return address.startswith("127.") or address == "::1" or address == GROUP  # joined at the loopback interface only


def attack(ports: dict[str, list[int]], seconds: float) -> dict[str, Any]:
    """Try all ports, forge scouting messages that lead here, listen to whoever comes, and send it an Abort."""
    import zenoh

    import imc

    opened: list[int] = []
    for port in ports["tcp"]:
        with contextlib.suppress(OSError), socket.create_connection((VEHICLE, port), timeout=0.3):
            opened.append(port)
    locator = f"tcp/{ATTACKER}:17447"
    config: Any = zenoh.Config()
    config.insert_json5("listen/endpoints", json.dumps([locator]))
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/{VEHICLE}:{port}" for port in ports["tcp"]]))
    heard: list[str] = []
    with zenoh.open(config) as session, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        subscribe: Any = session.declare_subscriber
        kept = subscribe("imc/**", lambda s: heard.append(str(s.key_expr)), allowed_origin=zenoh.Locality.REMOTE)
        zid = bytes.fromhex(str(session.info.zid()).zfill(32))[::-1]
        hello = bytes((0x22, 9, 15 << 4 | 1)) + zid + bytes((1, len(locator))) + locator.encode()
        udp.bind((ATTACKER, 0))
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(ATTACKER))
        announce = imc.Announce(
            src=0x4001, timestamp=time.time(), sys_name="attacker", services=f"imc+udp://{ATTACKER}:6001/"
        )
        packet = imc.encode(imc.Abort(src=0x4001, dst=0x001E, timestamp=time.time()))
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            for datagram in (hello, b"\x01\x09\x03"):
                for target in [(VEHICLE, port) for port in ports["udp"]] + [("224.0.0.224", 7446)]:
                    with contextlib.suppress(OSError):
                        udp.sendto(datagram, target)
            for place in (GROUP, "10.99.0.255", VEHICLE):
                for port in range(30100, 30105):
                    with contextlib.suppress(OSError):
                        udp.sendto(imc.encode(announce), (place, port))
            session.put(f"imc/{NAME}/@cmd/Abort/ccu", packet)
            session.put("imc/ccu/Abort/0", packet)
            time.sleep(0.1)
        kept.undeclare()
    return {"open": opened, "heard": len(heard)}


def main(folder: Path, scene: Callable[[Path, list[str]], dict[str, Any]]) -> None:
    ip("link", "set", "lo", "up")
    with subprocess.Popen(["unshare", "-n", "sleep", "60"]) as outside:
        while os.readlink(f"/proc/{outside.pid}/ns/net") == os.readlink("/proc/self/ns/net"):
            time.sleep(0.01)
        try:
            ip("link", "add", "cable0", "type", "veth", "peer", "name", "cable1", "netns", str(outside.pid))
            ip("addr", "add", f"{VEHICLE}/24", "dev", "cable0")
            ip("link", "set", "cable0", "up")
            enter = ["nsenter", "-t", str(outside.pid), "-n"]
            for words in (f"addr add {ATTACKER}/24 dev cable1", "link set cable1 up", "link set lo up"):
                subprocess.run([*enter, "ip", *words.split()], check=True)
            print(json.dumps(scene(folder, enter)))
        finally:
            outside.kill()


def scene(folder: Path, enter: list[str]) -> dict[str, Any]:
    """Vehicle and plain program here, the attacker in the namespace that `enter` leads to."""
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    command = ["-m", "shoal.cli", "run", NAME, "-p", "Simulation", "--bus", "zenoh", "--log-dir", str(folder)]
    vehicle = subprocess.Popen([sys.executable, *command], **pipes)
    told = lines(vehicle)
    try:
        wait_for(told, "LOG ")
        bound = {kind: sockets(kind, vehicle.pid) for kind in ("tcp", "udp")}
        plain = subprocess.Popen([sys.executable, __file__, "plain"], **pipes)
        received = wait_for(lines(plain), "EstimatedState")
        ports = {kind: sorted({port for _, port, _, _ in found}) for kind, found in bound.items()}
        attacker = [*enter, sys.executable, __file__, "attack", json.dumps(ports), str(WATCH)]
        attacking = subprocess.Popen(attacker, stdout=subprocess.PIPE, text=True)
        connected: set[str] = set()
        while attacking.poll() is None:
            connected |= {there for _, _, there, port in sockets("tcp", vehicle.pid) if port and not is_local(there)}
            time.sleep(0.1)
        assert attacking.stdout is not None
        assert attacking.returncode == 0
        done = json.loads(attacking.stdout.read())
        plain.kill()
        plain.wait()
    finally:
        vehicle.terminate()
        vehicle.wait(PATIENCE)
    return {
        "reachable": sorted(f"{kind} {a}:{port}" for kind in bound for a, port, _, _ in bound[kind] if not is_local(a)),
        "local": sum(is_local(a) for found in bound.values() for a, _, _, _ in found),
        "connected": sorted(connected),
        "received": received.strip(),
        **done,
    }


def twins(folder: Path, enter: list[str], *, scout: bool = False) -> dict[str, Any]:
    """A vehicle here that others can connect to, and another of the same name where `enter` leads to.

    With `scout` they have to find each other.
    """
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    command = [sys.executable, "-m", "shoal.cli", "run", NAME, "-p", "Simulation", "--bus", "zenoh", "--log-dir"]
    endpoint = f"tcp/{VEHICLE}:7448"
    listen, connect = ["--set", f"Zenoh:Listen={endpoint}"], ["--set", f"Zenoh:Connect={endpoint}"]
    if scout:
        listen, connect = (["--set", f"Zenoh:Scouting={cable}"] for cable in ("cable0", "cable1"))
        for side, cable in (([], "cable0"), (enter, "cable1")):
            subprocess.run([*side, "ip", "route", "add", "224.0.0.0/4", "dev", cable], check=True)
    first = subprocess.Popen([*command, str(folder / "first"), *listen], **pipes)
    try:
        wait_for(lines(first), "LOG ")
        second = subprocess.run(
            [*enter, *command, str(folder / "second"), *connect], **pipes, timeout=PATIENCE, check=False
        )
        return {"status": second.returncode, "told": second.stdout, "runs": first.poll() is None, "process": first.pid}
    finally:
        first.terminate()
        first.wait(PATIENCE)


def cut(folder: Path, enter: list[str]) -> dict[str, Any]:
    """A vehicle on both computers, over TLS, whose cable is cut for CUT s: when that was noticed, when all was back.

    The cable is not unplugged, which the computers would see at once: both send to an address that nobody has.
    """
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    command = [sys.executable, "-m", "shoal.cli", "run", NAME, "-p", "Simulation", "--bus", "zenoh"]
    files = {"Root Certificate": "ca.pem", "Certificate": f"{NAME}.pem", "Private Key": f"{NAME}.key"}
    settings = [f"Zenoh:{option}={folder / file}" for option, file in files.items()]
    settings += [f"Zenoh:Vehicles={NAME}", "Simulators.MUGDetectionCamera:Process=vision"]
    command += [word for setting in settings for word in ("--set", setting)]
    endpoint = f"tls/{VEHICLE}:7448"
    near = [*command, "--alone", "--log-dir", str(folder / "near"), "--set", f"Zenoh:Listen={endpoint}"]
    far = [*command, "--process", "vision", "--log-dir", str(folder / "far"), "--set", f"Zenoh:Connect={endpoint}"]
    first = subprocess.Popen(near, **pipes)
    told = lines(first)
    wait_for(told, "LOG ")
    second = subprocess.Popen([*enter, *far], **pipes)
    lines(second)
    try:
        wait_for(told, "process vision runs")
        sides = ([], "cable0", ATTACKER), (enter, "cable1", VEHICLE)
        for side, cable, other in sides:
            nobody = ["lladdr", "02:00:00:00:00:99", "nud", "permanent", "dev", cable]
            subprocess.run([*side, "ip", "neigh", "replace", other, *nobody], check=True)
        began = time.monotonic()
        wait_for(told, "process vision has ended")
        noticed = time.monotonic() - began
        time.sleep(max(0.0, CUT - noticed))
        for side, cable, other in sides:
            subprocess.run([*side, "ip", "neigh", "del", other, "dev", cable], check=True)
        ended = time.monotonic()
        wait_for(told, "process vision runs")
        return {"noticed": noticed, "back": time.monotonic() - ended}
    finally:
        for process in (second, first):
            process.terminate()
            process.wait(PATIENCE)


def listen() -> None:
    """A zenoh program without any configuration, which stays after its first message."""
    import zenoh

    with (
        zenoh.open(zenoh.Config()) as session,
        session.declare_subscriber(f"imc/{NAME}/EstimatedState/*") as states,
    ):
        for sample in states:
            print(sample.key_expr, flush=True)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["plain"]:
            listen()
        case ["attack", ports, seconds]:
            print(json.dumps(attack(json.loads(ports), float(seconds))))
        case ["twins", folder]:
            main(Path(folder), twins)
        case ["scouts", folder]:
            main(Path(folder), partial(twins, scout=True))
        case ["cut", folder]:
            main(Path(folder), cut)
        case [folder]:
            main(Path(folder), scene)
        case _:
            raise SystemExit(__doc__)
