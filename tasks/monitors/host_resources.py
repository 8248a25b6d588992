"""Reports how busy the vehicle's computer is, and how full its disk."""

import os
import shutil
from pathlib import Path

import imc
from runtime import State, Task, param, periodic

MIB = 1 << 20


class HostResources(Task):
    """Publishes CpuUsage of the computer, and StorageUsage of the disk that the logs are on, as the Daemon's.

    Its entity is in FAULT while the disk is fuller than `Maximum Storage Usage`, or the processor as busy on average
    by `Maximum CPU Usage`.
    """

    external = True  # the figures are not the same in each run

    execution_frequency: float = param(1.0, "Hz", "Rate of the reports.", minimum=0.001, maximum=1000)
    maximum_cpu: float = param(95.0, "%", "Usual load from which on the state is FAULT.", name="Maximum CPU Usage")
    maximum_storage: float = param(
        95.0, "%", "Used space from which on the state is FAULT.", name="Maximum Storage Usage"
    )
    samples: int = param(10, "1", "Reports in the average of the load.", name="Moving Average Samples", minimum=1)

    def start(self) -> None:
        self._before = cpu_total_and_idle()
        self._loads: list[float] = []
        self.set_entity_state(State.NORMAL, "active")

    @periodic("execution_frequency")
    def report(self) -> None:
        now, before = cpu_total_and_idle(), self._before
        self._before = now
        passed, idle = now[0] - before[0], now[1] - before[1]
        troubles: list[str] = []
        if passed > 0.0:
            load = min(100.0, max(0.0, 100.0 * (1.0 - idle / passed)))
            self._loads = [*self._loads, load][-self.samples :]
            self.publish(imc.CpuUsage(value=round(load)), entity=self.vehicle.daemon.entity)
            if len(self._loads) == self.samples and min(self._loads) >= self.maximum_cpu:
                troubles.append(f"the processor is busy: {load:.0f} %")
        try:
            usage = shutil.disk_usage(innermost_existing_folder(self.vehicle.log_root))
        except OSError as error:
            troubles.append(f"{self.vehicle.log_root}: {error.strerror}")
        else:
            used = 100.0 * (1.0 - usage.free / usage.total) if usage.total else 100.0
            free = min(usage.free // MIB, 0xFFFFFFFF)
            self.publish(imc.StorageUsage(available=free, value=round(used)), entity=self.vehicle.daemon.entity)
            if used >= self.maximum_storage:
                troubles.append(f"the disk of the logs is full: {free} MiB left")
        self.set_entity_state(State.FAULT if troubles else State.NORMAL, "; ".join(troubles) or "active")


def cpu_total_and_idle() -> tuple[float, float]:
    """Seconds of all processors, and those of them that were idle; without /proc/stat, of this process and the rest."""
    try:
        words = Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]
        times = list(map(int, words))  # user, nice, system, idle, waiting for disks, interrupts, stolen
        return float(sum(times)), float(times[3] + times[4])  # integers
    except (OSError, ValueError, IndexError):
        mine = os.times()
        return mine.elapsed * (os.cpu_count() or 1), mine.elapsed * (os.cpu_count() or 1) - mine.user - mine.system


def innermost_existing_folder(path: Path) -> Path:
    """The path, or the innermost folder above it that exists."""
    return next((place for place in (path, *path.absolute().parents) if place.exists()), path)
