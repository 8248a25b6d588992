"""Run in a network namespace of its own: a vehicle here, a console in a second one at the other end of a cable.

Arguments: a folder, and the vehicle's Network Address. Prints one JSON object: what reached the console.
"""

import json
import os
import select
import socket
import subprocess
import sys
import time

import imc
from imc.discovery import MULTICAST, PORTS, Service, Services

VEHICLE, CONSOLE = "10.99.0.1", "10.99.0.2"


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def console():
    """Announce by multicast, send heartbeats to the vehicle's address, and tell what came."""
    found = {"multicast": [], "broadcast": [], "unicast": [], "states": 0}
    places = {"multicast": MULTICAST, "broadcast": "10.99.0.255", "unicast": CONSOLE}
    sockets = {}
    for kind, address in places.items():
        sockets[kind] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sockets[kind].bind((address, PORTS[0]))
    group = socket.inet_aton(MULTICAST) + socket.inet_aton(CONSOLE)
    sockets["multicast"].setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
    data = sockets["data"] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    data.bind((CONSOLE, 0))
    services = str(Services.from_system_info([Service("imc+udp", CONSOLE, data.getsockname()[1])]))
    announce = imc.Announce(src=0x4042, sys_name="console", services=services)
    names = {sock: kind for kind, sock in sockets.items()}
    begin, end, due = time.monotonic(), time.monotonic() + float(sys.argv[3]), 0.0
    while (now := time.monotonic()) < end and (found["states"] < 3 or not found["unicast"]):
        if now > due:
            due = now + 1.0
            data.sendto(imc.encode(announce.replace(timestamp=time.time())), (MULTICAST, PORTS[now - begin > 3]))
            data.sendto(imc.encode(imc.Heartbeat(src=0x4042, timestamp=time.time())), (VEHICLE, 6002))
        for sock in select.select(list(names), [], [], 0.1)[0]:
            message = imc.decode(sock.recv(65535))
            if names[sock] == "data":
                found["states"] += isinstance(message, imc.EstimatedState)
            elif isinstance(message, imc.Announce) and message.src == 0x1A:
                ends = Services.parse(message.services).endpoints("imc+udp")
                found[names[sock]] = sorted({*map(tuple, found[names[sock]]), *map(tuple, ends)})
    print(json.dumps(found))


def main():
    if sys.argv[1] == "console":
        console()
        return
    folder, address, seconds = sys.argv[1:4]
    ip("link", "set", "lo", "up")
    ip("link", "add", "cable0", "type", "veth", "peer", "name", "cable1")
    with subprocess.Popen(["unshare", "-n", "sleep", "100"]) as outside:
        time.sleep(0.3)
        ip("link", "set", "cable1", "netns", str(outside.pid))
        inside = ["nsenter", "-t", str(outside.pid), "-n"]
        ip("addr", "add", f"{VEHICLE}/24", "broadcast", "+", "dev", "cable0")
        ip("link", "set", "cable0", "up")
        for words in (
            ["addr", "add", f"{CONSOLE}/24", "broadcast", "+", "dev", "cable1"],
            ["link", "set", "cable1", "up"],
        ):
            subprocess.run([*inside, "ip", *words], check=True)
        command = [sys.executable, "-m", "shoal.cli", "run", "lauv-noptilus-1", "-p", "Simulation", "--for", "60s"]
        command += ["--set", f"General:Network Address={address}"]
        with open(os.path.join(folder, "out.txt"), "w") as out:
            vehicle = subprocess.Popen(command, cwd=folder, stdout=out, stderr=out)
            time.sleep(2.0)
            subprocess.run([*inside, sys.executable, __file__, "console", "-", seconds], check=True)
            vehicle.terminate()
            vehicle.wait()
        outside.terminate()


if __name__ == "__main__":
    main()
