"""Sends text messages with the position when the vehicle is aborted, or out of reach of its consoles."""

import math
from collections import deque
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import ClassVar

import imc
from imc.console_links import has_console
from imc.reserved_ids import OPERATORS
from runtime import State, Task, consume, param, periodic
from runtime.profile import listed_consoles
from support.diagnostics import ConfigWarning
from support.wgs84 import is_on_earth

Mode = imc.VehicleState.OpMode
Where = imc.VehicleMedium.Medium
Report = imc.ReportControl
LETTERS: Mapping[int, str] = {
    Mode.BOOT: "B",
    Mode.CALIBRATION: "C",
    Mode.ERROR: "E",
    Mode.EXTERNAL: "X",
    Mode.MANEUVER: "M",
    Mode.SERVICE: "S",
}
LONGEST_EXPIRATION = 0xFFFF  # s, of an Sms
IRIDIUM_TTL = 60  # s
PAUSE = 2.0  # s between two reports that were requested
ANSWER_PAUSE = 30.0  # s between two answers to text messages: each costs money
MOST_REPORTS = 16
LONGEST_NUMBER = 32
LARGEST = 99_999.0  # of a percentage, or ten times a voltage (V)


class Emergency(Task):
    """Sends Sms and IridiumMsgTx, in the words of DUNE's task of this name, for the modems on board.

    It sends "(A)" after an Abort; "(T)" when no console that may command was in reach for the timeout, while it is
    active and not under water, or at the surface without a plan; "(R)" when a report is requested over GSM, under water
    when it has come up; and "(T)" as the answer to the text "pos". The texts "gsm true" and "gsm false" make it active
    and inactive. Time under water does not count. A message has the time and the position (degrees and minutes) of the
    last valid fix, the fuel level f and its confidence c (%), ten times the voltage v, the mode s, and the progress p
    of a plan (%); -1 is unknown.
    """

    activation: ClassVar[str] = "idle"
    active: bool = param(False, "", "Send also while a plan runs.", scope="idle", visibility="user")
    sms_recipient_number: str = param(
        "", "", "Telephone number that gets the messages.", name="SMS Recipient Number", visibility="user"
    )
    lost_communications_timeout: float = param(300.0, "s", "Time without a console.", minimum=60, visibility="user")
    transmission_interface: str = param("Both", "", "Modem that sends.", choices=("GSM", "Iridium", "Both"))
    abort_expiration: int = param(
        30, "s", "Longest delay of the message after an Abort.", name="Expiration Time - Abort SMS",
        minimum=30, maximum=0xFFFFFFFF,
    )  # fmt: skip
    lost_expiration: int = param(
        30, "s", "Longest delay of other messages.", name="Expiration Time - Lost Communications",
        minimum=0, maximum=0xFFFFFFFF,
    )  # fmt: skip
    batteries: str = param("Batteries", "", "Entity of the battery.", name="Entity Label - Batteries")
    execution_frequency: float = param(1.0, "Hz", "Rate of its checks.", minimum=0.001, maximum=1000)

    def configure(self) -> None:
        self._consoles = listed_consoles(self)

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        if not self.sms_recipient_number:
            yield ConfigWarning("Entity Label", "no SMS Recipient Number is set, so no message is sent")

    def start(self) -> None:
        self._place = ""
        self._fuel = self._confidence = self._voltage = -1.0
        self._mode = self._medium = -1
        self._plan: imc.PlanControlState | None = None
        self._received_at = self.now
        self._aborted = self._answered = self._reported = -math.inf
        self._requests: deque[imc.ReportControl] = deque()
        self._number = 0
        self._report_state()

    def activate(self) -> None:
        self._report_state(active=True)

    def deactivate(self) -> None:
        self._report_state(active=False)

    @consume
    def on_gps_fix(self, fix: imc.GpsFix) -> None:
        if fix.validity & imc.GpsFix.Validity.VALID_POS and is_on_earth(fix.lat, fix.lon):
            self._place = f"{self._clock()} / {_degrees_minutes(fix.lat)}, {_degrees_minutes(fix.lon)}"

    @consume
    def on_fuel_level(self, fuel: imc.FuelLevel) -> None:
        self._fuel, self._confidence = fuel.value, fuel.confidence

    @consume
    def on_voltage(self, voltage: imc.Voltage) -> None:
        if self.vehicle.entities.label(voltage.src, voltage.src_ent) == self.batteries:
            self._voltage = 10.0 * voltage.value

    @consume
    def on_plan_state(self, plan: imc.PlanControlState) -> None:
        self._plan = plan

    @consume
    def on_vehicle_state(self, state: imc.VehicleState) -> None:
        self._mode = state.op_mode

    @consume
    def on_medium(self, medium: imc.VehicleMedium) -> None:
        self._medium = medium.medium
        if medium.medium == Where.UNDERWATER:
            self._received_at = self.now

    @consume(others=True)
    def on_heartbeat(self, beat: imc.Heartbeat) -> None:
        """Begin the time again while a console is in reach."""
        if beat.src in OPERATORS and self._consoles.may_command(beat.src):
            self._received_at = self.now

    @consume
    def on_links(self, links: imc.VehicleLinks) -> None:
        """Begin the time again while a ground station of another protocol is in reach."""
        if has_console(links):
            self._received_at = self.now

    @consume(others=True)
    def on_abort(self, abort: imc.Abort) -> None:
        """Send one message for an Abort that is repeated."""
        if self.is_addressed_or_broadcast(abort):
            if self.now - self._aborted >= self.abort_expiration:
                self._send("A", self.abort_expiration, self.sms_recipient_number)
            self._aborted = self.now

    @consume(others=True)
    def on_text(self, text: imc.TextMessage) -> None:
        """Obey a text that a modem on board, or a console, gives."""
        if not self.is_for_me(text):
            return
        command, _, argument = text.text.strip().lower().partition(" ")
        if command == "gsm" and argument in ("true", "false"):
            self.vehicle.activations[self.name].request(argument == "true")
        elif command == "pos" and self.now - self._answered >= ANSWER_PAUSE:
            self._answered = self.now
            self._send("T", self.lost_expiration, text.origin or self.sms_recipient_number)

    @consume(others=True)
    def on_report_request(self, request: imc.ReportControl) -> None:
        """Queue a report, one for each recipient."""
        if request.op != Report.Op.REQUEST_REPORT or not self.is_for_me(request):
            return
        waits = any(before.sys_dst == request.sys_dst for before in self._requests)
        if request.comm_interface & Report.CommInterface.GSM and not waits and len(self._requests) < MOST_REPORTS:
            self._requests.append(request)

    @periodic("execution_frequency")
    def check(self) -> None:
        """Send a report that was requested, and the message that the vehicle is out of reach."""
        afloat = self._medium != Where.UNDERWATER
        if self._requests and afloat and self.now - self._reported >= PAUSE:
            request, self._reported = self._requests.popleft(), self.now
            number = self.sms_recipient_number if request.sys_dst == "default" else request.sys_dst
            if self._send("R", self.lost_expiration, number):
                done = Report(op=Report.Op.REPORT_SENT, comm_interface=request.comm_interface, sys_dst=request.sys_dst)
                self.reply(request, done)
        if self.age(self._received_at) >= self.lost_communications_timeout:
            self._received_at = self.now
            if (self.active and afloat) or (self._medium == Where.WATER and not self._in_plan()):
                self._send("T", self.lost_expiration, self.sms_recipient_number)

    def _in_plan(self) -> bool:
        return self._plan is not None and self._plan.state == imc.PlanControlState.State.EXECUTING

    def _text(self, prefix: str) -> str:
        progress = f" / p:{_figure(self._plan.plan_progress)}" if self._plan is not None and self._in_plan() else ""
        place = self._place or f"{self._clock()} / Unknown Location"
        energy = f"f:{_figure(self._fuel)} v:{_figure(self._voltage)} c:{_figure(self._confidence)}"
        return f"({prefix}) ({self.vehicle.name}) {place} / {energy} / s: {LETTERS.get(self._mode, '?')}{progress}"

    def _send(self, prefix: str, expires: int, number: str) -> bool:
        """Give a message to the modems; False if there is no number to send it to."""
        text = self._text(prefix)
        if not number or len(number) > LONGEST_NUMBER or not number.isprintable():
            self.log.error(f"no telephone number for {text}")
            return False
        self.log.info(f"sending to {number} within {expires} s: {text}")
        if self.transmission_interface != "GSM":
            self._number = (self._number + 1) & 0xFFFF
            self.publish(imc.IridiumMsgTx(req_id=self._number, ttl=IRIDIUM_TTL, data=text.encode()))
        if self.transmission_interface != "Iridium":
            self.publish(imc.Sms(number=number, timeout=min(expires, LONGEST_EXPIRATION), contents=text))
        return True

    def _clock(self) -> str:
        return datetime.fromtimestamp(self.now, UTC).strftime("%H:%M:%S")

    def _report_state(self, *, active: bool | None = None) -> None:
        is_active = self.active if active is None else active
        if self.sms_recipient_number:
            self.set_entity_state(State.NORMAL, "active" if is_active else "idle")
        else:
            self.set_entity_state(State.FAULT, "no SMS Recipient Number is set")


def _figure(value: float) -> int:
    """A value as an integer; -1 if it is none that a vehicle can have."""
    return int(value) if -LARGEST <= value <= LARGEST else -1


def _degrees_minutes(angle: float) -> str:
    """An angle (rad) in degrees and minutes: "41 11.123456"; the sign is that of both."""
    sign = "-" if angle < 0.0 else ""
    whole = round(abs(math.degrees(angle)) * 60e6)
    return f"{sign}{whole // 60_000_000} {whole % 60_000_000 / 1e6:.6f}"
