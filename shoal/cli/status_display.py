"""The status of a run: a live panel on a terminal, lines in a pipe."""

import math
import os
import shlex
import time
from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

import imc
from runtime.logs import resolve_log_folder
from runtime.task import Entity, State
from runtime.vehicle import Vehicle
from shoal.cli.time_texts import format_clock_time
from support.positions import format_position
from support.terminal_text import printable

REFRESH = 0.25  # s of real time between updates of the panel
LINE_PERIOD = 10.0  # s of real time between status lines in a pipe
MOST_TEXTS = 10  # of other systems, shown in one second; the log has all
TROUBLE = (State.FAULT, State.ERROR, State.FAILURE)
ECHO = 4  # columns; a terminal writes ^C at the end of the panel's last line, which must not wrap
LEVELS: dict[int, tuple[str, str]] = {
    imc.LogBookEntry.Type.INFO: ("INFO", ""),
    imc.LogBookEntry.Type.WARNING: ("WARNING", "yellow"),
    imc.LogBookEntry.Type.ERROR: ("ERROR", "red"),
    imc.LogBookEntry.Type.CRITICAL: ("CRITICAL", "bold red"),
    imc.LogBookEntry.Type.DEBUG: ("DEBUG", "dim"),
}


class StatusDisplay:
    """Shows the status of a vehicle from its bus; it publishes nothing, so the run is the same without it."""

    transient = True

    def __init__(self, vehicle: Vehicle, title: str, duration: float | None):
        self.vehicle = vehicle
        self.title = title
        self.duration = duration
        self.state: imc.EstimatedState | None = None
        self.mode: str = ""
        self.plan: str = ""
        self.detections: int = 0
        self.mug: str = ""
        self.folder: str = str(vehicle.log_folder or "")  # known already if the run continues from a snapshot
        self._console = Console(highlight=False, emoji=False, soft_wrap=True)
        self._live: Live | None = None
        self._left = False
        self._texts = (0, 0)
        self._rate = 0.0
        self._speed = 1.0
        self._began = (time.monotonic(), vehicle.kernel.clock.read() / 1e9)
        self._counted = (0, *self._began)
        self._next_line = self._began[0] + LINE_PERIOD
        vehicle.observe(imc.EstimatedState, self._on_estimated_state)
        vehicle.observe(imc.EstimatedMugState, self._on_mug_state)
        vehicle.observe(imc.LoggingControl, self._on_logging_control)
        vehicle.observe(imc.VehicleState, self._on_vehicle_state)
        vehicle.observe(imc.PlanControlState, self._on_plan_state)
        vehicle.observe(imc.LogBookEntry, self._on_log_book_entry)

    @property
    def now(self) -> float:
        return self.vehicle.kernel.now_ns / 10**9

    def __enter__(self) -> "StatusDisplay":
        if self._console.is_terminal:
            self._live = Live(self._panel(), console=self._console, auto_refresh=False, transient=False)
            with self._ignoring_closed_terminal():
                self._live.start()
        self._tick()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._counted = (0, *self._began)
            self._refresh()
            with self._ignoring_closed_terminal():
                self._live.stop()
            self._live = None

    def run_summary(self) -> str:
        """One line about the run and, without a panel, one for each entity that ended in trouble."""
        real, passed = time.monotonic() - self._began[0], self.now - self._began[1]
        pace = self.vehicle.realtime_lag.describe_run(passed, real) if self.vehicle.realtime_lag is not None else ""
        span = f"{passed:.1f} s of vehicle time in {real:.1f} s" + (f" ({pace})" if pace else "")
        parts = [span, self._messages()]
        if self.detections:
            parts.append(f"{self.detections} MUG detection{'s' * (self.detections != 1)}")
        if self.folder:
            parts.append(f"log in {self.folder}, shown by: shoal log info {shlex.quote(str(self.folder))}")
        troubled = [entity for entity in self.vehicle.entities if entity.stateful and entity.state in TROUBLE]
        return "\n".join([", ".join(parts), *(map(_trouble_line, troubled) if not self._console.is_terminal else ())])

    def _tick(self) -> None:
        if self._live is None and time.monotonic() >= self._next_line:
            self._next_line += LINE_PERIOD
            words = [self._position(), *self._entities().plain.split("\n"), self._messages()]
            words += (
                [str(self.vehicle.realtime_lag)]
                if self.vehicle.realtime_lag is not None and str(self.vehicle.realtime_lag)
                else []
            )
            self._print(Text(f"{format_clock_time(self.now)} STATUS  {', '.join(words)}"))
        elif self._live is not None and time.monotonic() - self._counted[1] >= REFRESH:
            self._refresh()
        step = REFRESH * min(self.vehicle.kernel.clock.speed, 40.0)
        self.vehicle.kernel.after(step, self._tick)

    def _refresh(self) -> None:
        count, then, at = self._counted
        now, real = self.now, time.monotonic()
        if real - then >= REFRESH / 2 and now > at:
            self._rate = (self.vehicle.bus.delivered - count) / (now - at)
            self._speed = (now - at) / (real - then)
        self._counted = (self.vehicle.bus.delivered, real, now)
        if self._live is not None and not self._left:
            with self._ignoring_closed_terminal():
                self._live.update(self._panel(), refresh=True)

    def _panel(self) -> Panel:
        table = Table.grid(padding=(0, 2))
        table.add_column(style="dim", justify="right")
        table.add_column()
        passed = self.now - self._began[1]
        span = f"{passed:.1f} s" + (f" of {self.duration:g} s" if self.duration is not None else "")
        speed = f"{self._speed:.3g} x real time   {self.vehicle.realtime_lag or ''}"
        table.add_row("time", f"{format_clock_time(self.now)}   {span}   {speed}")
        table.add_row("vehicle", self._position())
        if self.mode:
            table.add_row("mode", Text("   ".join(filter(None, [self.mode, printable(self.plan)]))))
        table.add_row("entities", self._entities())
        if self.detections:
            table.add_row("detections", f"{self.detections}   {self.mug}")
        table.add_row("messages", f"{self._messages()}   {self._rate:.0f} per second of vehicle time")
        table.add_row("log", Text(printable(self.folder) or "-"))
        return Panel(
            table,
            title=Text(printable(self.title)),
            title_align="left",
            subtitle="Ctrl-C stops",
            subtitle_align="right",
            width=max(self._console.width - ECHO, ECHO),
        )

    def _messages(self) -> str:
        bus = self.vehicle.bus
        parts = [f"{bus.delivered} message{'s' * (bus.delivered != 1)}"]
        for number, what in ((bus.inbox.dropped.total, "of others dropped"), (bus.malformed, "of others malformed")):
            parts += [f"{number} {what}"] * bool(number)
        return ", ".join(parts)

    def _position(self) -> str:
        state = self.state
        if state is None:
            return "no EstimatedState yet"
        values = (state.lat, state.lon, state.height, state.x, state.y, state.z, state.depth, state.alt, state.psi)
        if not all(map(math.isfinite, values)):
            return "EstimatedState is not finite"
        lat, lon, height = imc.coordinates.absolute_position(state)
        depth = f"depth {state.depth:.2f} m" if state.depth >= 0.0 else f"height {height:.1f} m"
        altitude = f"   altitude {state.alt:.1f} m" if state.alt >= 0.0 else ""
        return (
            f"{format_position(lat, lon)}   {depth}{altitude}   "
            f"{math.hypot(state.vx, state.vy):.2f} m/s   heading {math.degrees(state.psi) % 360.0:05.1f}°"
        )

    def _entities(self) -> Text:
        stateful = [entity for entity in self.vehicle.entities if entity.stateful]
        normal = sum(entity.state is State.NORMAL for entity in stateful)
        text = Text(f"{normal} of {len(stateful)} normal")
        for entity in stateful:
            if entity.state is not State.NORMAL:
                color = "yellow" if entity.state in (State.BOOT, State.FAULT) else "red"
                text.append(f"\n{_trouble_line(entity)}", style=color)
        return text

    def _on_estimated_state(self, state: imc.EstimatedState) -> None:
        if state.src == self.vehicle.system or self.state is None or self.state.src == state.src:
            self.state = state

    def _on_mug_state(self, mug: imc.EstimatedMugState) -> None:
        self.detections += 1
        self.mug = f"last: MUG {mug.id} at {mug.x:+.2f} m north, {mug.y:+.2f} m east of the vehicle"

    def _on_logging_control(self, control: imc.LoggingControl) -> None:
        if control.op != imc.LoggingControl.Op.STARTED or control.src != self.vehicle.system:
            return
        folder = self.vehicle.log_root / self.vehicle.name / control.name
        if self.vehicle.has_virtual_time:
            folder = resolve_log_folder(folder, self.vehicle.log_folder)
        if not os.path.isdir(folder):  # another process of the vehicle has it elsewhere
            return
        self.folder = str(folder)
        if self._live is None:
            self._print(Text(printable(f"{format_clock_time(control.timestamp)} LOG     {self.folder}")))

    def _on_vehicle_state(self, state: imc.VehicleState) -> None:
        if state.src == self.vehicle.system:
            self.mode = next((mode.name for mode in imc.VehicleState.OpMode if mode == state.op_mode), "unknown")

    def _on_plan_state(self, state: imc.PlanControlState) -> None:
        if state.src == self.vehicle.system:
            flying = state.state == imc.PlanControlState.State.EXECUTING
            progress = f", {state.plan_progress:.0f} %" if state.plan_progress >= 0.0 else ""
            self.plan = f"plan {state.plan_id}, maneuver {state.man_id}{progress}" if flying else ""

    def _on_log_book_entry(self, entry: imc.LogBookEntry) -> None:
        if entry.src != self.vehicle.system:
            second = int(self.now)
            self._texts = (second, self._texts[1] + 1 if self._texts[0] == second else 1)
            if self._texts[1] > MOST_TEXTS:
                return
        level, style = LEVELS.get(entry.type, ("INFO", ""))
        source = "" if entry.src == self.vehicle.system else f"{self.vehicle.systems.name(entry.src)} "
        line = printable(f"{format_clock_time(entry.timestamp)} {level:<7} [{source}{entry.context}] {entry.text}")
        self._print(Text(line, style=style))

    def _print(self, line: Text) -> None:
        if not self._left:
            with self._ignoring_closed_terminal():
                self._console.print(line)

    @contextmanager
    def _ignoring_closed_terminal(self) -> Generator[None]:
        """Keep the vehicle running if the terminal or the reader of the pipe is gone; rich raises SystemExit then."""
        try:
            yield
        except (OSError, SystemExit):
            self._left = True


def _trouble_line(entity: Entity) -> str:
    return printable(f"{entity.label}: {entity.state.name} {entity.description}")
