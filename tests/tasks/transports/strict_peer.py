"""A ground station written from the specification: every request has a time-out and retries, five for missions, and
every answer is checked for its target, its order and what must not follow."""

import math
import socket

from mavlink import encode, split
from mavlink.vehicle.files.ftp_messages import ACK, LAYOUT, FtpOpcode
from tests.tasks.transports.lossy import HOST, Trouble
from tests.tasks.transports.mavlink_files import meaning, request, taken
from tests.tasks.transports.mavlink_station import DIALECT

RETRIES = 5  # of the mission protocol
MORE_RETRIES = 12  # of the others, whose specifications name no number
PATIENCE, ITEM_PATIENCE = 1.5, 0.25  # s
END = 0.5  # s of silence that are the end of a list
IN_PROGRESS, ACCEPTED = 5, 0
CHUNK, PIECE = 90, 239  # bytes of LOG_DATA, of a file
TRANSFERS = ("MISSION_REQUEST_INT", "MISSION_ACK", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_REQUEST")
ADDRESSED = (*TRANSFERS, "COMMAND_ACK", "FILE_TRANSFER_PROTOCOL", "PARAM_ERROR")


class NoAnswer(Exception):
    """The vehicle did not answer in time, in spite of all retries."""


class Line:
    """One UDP socket, behind which several peers may be, and the vehicle at its other end.

    `advance` lets some time pass, and `clock` tells it (s). Both directions suffer `trouble`.
    """

    def __init__(self, vehicle, advance, clock, **trouble):
        self.vehicle, self.advance, self.clock = (HOST, vehicle), advance, clock
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, 0))
        self.socket.setblocking(False)
        self.out, self.back = Trouble(**trouble), Trouble(**{**trouble, "seed": trouble.get("seed", 1) + 1000})
        self.peers = []
        self._wait = []

    def send(self, frame):
        for delay in self.out.fates():
            self._wait.append((self.clock() + delay, True, frame))
        self._deliver()

    def pass_time(self):
        """Let some time pass, and deliver what arrives in it."""
        self.advance()
        while True:
            try:
                frame = self.socket.recv(2048)
            except BlockingIOError:
                break
            for delay in self.back.fates():
                self._wait.append((self.clock() + delay, False, frame))
        self._deliver()

    def _deliver(self):
        now = self.clock()
        due = [item for item in self._wait if item[0] <= now]
        self._wait = [item for item in self._wait if item[0] > now]
        for _, outward, frame in due:
            if outward:
                self.socket.sendto(frame, self.vehicle)
                continue
            (message,), damages = split(frame, DIALECT)
            assert not damages
            for peer in self.peers:
                peer.hear(message)


class Peer:
    """A ground station that talks to a component of the vehicle; a `silent` one neither sends nor hears."""

    def __init__(self, line, target, system=255, component=190, of=1):
        self.line, self.target, self.system, self.component, self.of = line, target, system, component, of
        self.inbox, self.heard, self.sequence, self.silent = [], [], 0, False
        self.file_sequence = 0
        line.peers.append(self)

    def hear(self, message):
        """Take a message of that component that is for this peer, or for all."""
        values = message.values
        if self.silent or message.component != self.of:
            return
        if message.name in ADDRESSED:
            assert values["target_system"] != 0, "answers go to whom asked"
            if (values["target_system"], values["target_component"]) != (self.system, self.component):
                return
        self.inbox.append(message)
        self.heard.append((self.line.clock(), message.name, values))

    def send(self, name, **fields):
        if not self.silent:
            definition = DIALECT.by_name[name]
            fields = {"target_system": self.target, "target_component": self.of, **fields}
            self.line.send(encode(definition, definition.pack(fields), self.sequence, self.system, self.component))
            self.sequence = (self.sequence + 1) % 256

    def wait(self, seconds, *names, where=lambda values: True):
        """The next message with one of the names; None if there is none in time."""
        end = self.line.clock() + seconds
        while True:
            while self.inbox:
                message = self.inbox.pop(0)
                if message.name in names and where(message.values):
                    return message
            if self.line.clock() >= end:
                return None
            self.line.pass_time()

    def ask(self, seconds, names, name, where=lambda values: True, *, retries=MORE_RETRIES, **fields):
        """The answer to a message, which is sent again if there is none."""
        for _ in range(1 + retries):
            self.send(name, **fields)
            if (found := self.wait(seconds, *names, where=where)) is not None:
                return found
        raise NoAnswer(name)

    def upload(self, items, kind=0, until=math.inf):
        """The MISSION_ACK of an upload; falls silent when it should send item `until`."""

        def mine(values):
            return values["mission_type"] == kind

        names = ("MISSION_REQUEST_INT", "MISSION_ACK")
        answer = self.ask(PATIENCE, names, "MISSION_COUNT", mine, retries=RETRIES, count=len(items), mission_type=kind)
        latest, highest, tries = -1, -1, 0
        while answer is None or answer.name == "MISSION_REQUEST_INT":
            if answer is None:
                tries += 1
                if tries > RETRIES:
                    raise NoAnswer(f"item {latest}")
            elif (seq := answer.values["seq"]) != latest:
                assert seq <= highest + 1, "items are asked for in order"
                assert seq < len(items)
                latest, highest, tries = seq, max(seq, highest), 0
            if latest >= until:
                self.silent = True
                return None
            self.send("MISSION_ITEM_INT", **{**items[latest], "seq": latest, "mission_type": kind})
            answer = self.wait(PATIENCE, *names, where=mine)
        return answer.values

    def download(self, kind=0):
        """The items of the vehicle, and the id that came with their number."""

        def mine(values):
            return values["mission_type"] == kind

        names = ("MISSION_COUNT",)
        count = self.ask(PATIENCE, names, "MISSION_REQUEST_LIST", mine, retries=RETRIES, mission_type=kind).values
        items = []
        for seq in range(count["count"]):

            def this(values, seq=seq):
                return mine(values) and values["seq"] == seq

            wish = {"seq": seq, "mission_type": kind, "retries": RETRIES}
            found = self.ask(ITEM_PATIENCE, ("MISSION_ITEM_INT",), "MISSION_REQUEST_INT", this, **wish)
            items.append(found.values)
        self.send("MISSION_ACK", type=ACCEPTED, mission_type=kind)
        return items, count["opaque_id"]

    def order(self, command, *params):
        """The final result of a command, which counts its repetitions."""
        named = {f"param{number}": value for number, value in enumerate(params, 1)}

        def mine(values):
            return values["command"] == command

        for confirmation in range(1 + MORE_RETRIES):
            self.send("COMMAND_LONG", command=command, confirmation=confirmation, **named)
            found = self.wait(PATIENCE, "COMMAND_ACK", where=mine)
            if found is not None and found.values["result"] == IN_PROGRESS:
                found = self.wait(PATIENCE, "COMMAND_ACK", where=lambda v: mine(v) and v["result"] != IN_PROGRESS)
            if found is not None:
                return found.values["result"]
        raise NoAnswer(f"command {command}")

    def parameters(self):
        """All parameters by index; those that are missing at the end of the list are asked for, again and again."""
        found, count = {}, None
        message = self.ask(PATIENCE, ("PARAM_VALUE",), "PARAM_REQUEST_LIST")
        for _ in range(1 + MORE_RETRIES):
            while message is not None:
                count = message.values["param_count"]
                found[message.values["param_index"]] = message.values
                message = self.wait(END, "PARAM_VALUE")
            for index in set(range(count)) - set(found):
                self.send("PARAM_REQUEST_READ", param_index=index)
            message = self.wait(PATIENCE, "PARAM_VALUE") if len(found) < count else None
        assert {values["param_count"] for values in found.values()} == {count} == {len(found)}
        return found

    def set_parameter(self, name, value, kind):
        """The value that is shown then."""
        fields = {"param_id": name, "param_value": value, "param_type": kind}

        def this(values):
            return values["param_id"].rstrip(b"\0") == name and values["param_value"] == value

        return self.ask(PATIENCE, ("PARAM_VALUE",), "PARAM_SET", this, **fields).values["param_value"]

    def ask_for_file(self, opcode, data=b"", **how):
        """The data of an answer, or why there is none; the sequence number tells which request it answers."""
        self.file_sequence = (self.file_sequence + 2) & 0xFFFF
        payload = request(opcode, data, sequence=self.file_sequence, **how)

        def this(values):
            return int.from_bytes(values["payload"][:2], "little") == (self.file_sequence + 1) & 0xFFFF

        name = "FILE_TRANSFER_PROTOCOL"
        answer = bytes(self.ask(PATIENCE, (name,), name, this, payload=payload).values["payload"])
        return meaning(answer[: LAYOUT.size + answer[4]])

    def fetch(self, path):
        """The content of a file, in bursts."""
        size, data = int.from_bytes(self.ask_for_file(FtpOpcode.OPEN, path), "little"), b""
        while len(data) < size:
            self.file_sequence = (self.file_sequence + 2) & 0xFFFF
            wish = request(FtpOpcode.BURST, sequence=self.file_sequence, offset=len(data), size=PIECE)
            self.send("FILE_TRANSFER_PROTOCOL", payload=wish)
            complete = False
            while not complete:
                answer = bytes(self.wait(PATIENCE, "FILE_TRANSFER_PROTOCOL").values["payload"])
                _, _, kind, _, complete, offset, piece = taken(answer[: LAYOUT.size + answer[4]])
                assert (kind, offset) == (ACK, len(data))
                data += piece
            self.file_sequence += size // PIECE + 1  # the answers count on
        assert self.ask_for_file(FtpOpcode.TERMINATE) == b""
        return data

    def logs(self):
        """The entries of all logs, by their numbers."""
        found = {}
        message = self.ask(PATIENCE, ("LOG_ENTRY",), "LOG_REQUEST_LIST", start=0, end=0xFFFF)
        while message is not None:
            found[message.values["id"]] = message.values
            last, count = message.values["last_log_num"], message.values["num_logs"]
            message = self.wait(END, "LOG_ENTRY")
        for number in sorted(set(range(last - count + 1, last + 1)) - set(found)):

            def this(values, number=number):
                return values["id"] == number

            wish = {"start": number, "end": number}
            found[number] = self.ask(PATIENCE, ("LOG_ENTRY",), "LOG_REQUEST_LIST", this, **wish).values
        return found

    def log(self, number, size):
        """The bytes of a log; gaps are asked for again."""
        pieces = {}
        self.send("LOG_REQUEST_DATA", id=number, ofs=0, count=size)
        for _ in range(size // CHUNK + 100):
            while (message := self.wait(END, "LOG_DATA", where=lambda v: v["id"] == number)) is not None:
                pieces[message.values["ofs"]] = bytes(message.values["data"][: message.values["count"]])
            missing = [offset for offset in range(0, size, CHUNK) if offset not in pieces]
            if not missing:
                self.send("LOG_REQUEST_END")
                return b"".join(pieces[offset] for offset in sorted(pieces))
            for offset in missing[:30]:
                self.send("LOG_REQUEST_DATA", id=number, ofs=offset, count=CHUNK)
        raise NoAnswer("LOG_DATA")
