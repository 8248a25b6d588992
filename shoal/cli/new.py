"""`shoal new`: creates a working task, driver, vehicle or scenario to start from, with a test."""

import keyword
import re
import sys
from pathlib import Path

import click

from runtime.profile import load_profile
from shoal.cli import CommandGroup
from shoal.cli.options import config_dir_option
from support.diagnostics import ProfileError
from support.top_level_packages import PACKAGES

TASK = '''"""{title}: reports the greatest depth of the vehicle."""

import imc
from runtime import State, Task, consume, param, periodic


class {cls}(Task):
    """Reports the greatest depth so far."""

    rate: float = param(1.0, "Hz", "How often to report.", minimum=0.1, maximum=10.0)

    def start(self) -> None:
        self.deepest = 0.0
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def follow(self, state: imc.EstimatedState) -> None:
        self.deepest = max(self.deepest, state.depth)

    @periodic("rate")
    def report(self) -> None:
        self.publish(imc.Depth(value=self.deepest))
'''

TASK_TEST = '''"""{cls} reports the greatest depth."""

import imc
import pytest
from {module} import {cls}
from runtime.testing import simulate


def test_it_reports_the_greatest_depth():
    dive = [imc.EstimatedState(timestamp=t, depth=depth) for t, depth in enumerate([0.0, 3.0, 7.5, 2.0])]
    run = simulate({cls}, feed=dive, seconds=10.0)
    assert max(report.value for report in run.of(imc.Depth)) == pytest.approx(7.5)
    assert run.of(imc.Depth)[0].value == 0.0
'''

DRIVER = '''"""{title}: a sensor of depth at a serial port."""

import imc
from runtime import Task, expect, param
from runtime.devices import parse_number


class {cls}(Task):
    """Publishes the depths that a sensor sends, one a line."""

    external = True
    requires = "drivers"

    port: str = param("", "", "Serial port of the sensor.", name="Serial Port - Device", editable=False)
    baud: int = param(9600, "Bd", "Baud rate of the port.", name="Serial Port - Baud Rate", minimum=1, editable=False)

    def start(self) -> None:
        self.sensor = self.serial(self.port, self.baud, lines=self.measure)

    @expect(every=2.0)
    def measure(self, line: str) -> None:
        self.publish(imc.Depth(value=parse_number(line)))
'''

DRIVER_TEST = '''"""{cls} publishes what its sensor sends."""

import imc
from {module} import {cls}
from runtime import State
from runtime.testing import simulate


def test_each_line_is_a_depth():
    run = simulate({cls}, stream="1.5\\r\\nrubbish\\r\\nnan\\r\\n2.5\\r\\n")
    assert [depth.value for depth in run.of(imc.Depth)] == [1.5, 2.5]
    assert run.task.sensor.bad == 2


def test_silence_is_an_error():
    run = simulate({cls}, stream=[(0.0, "1.5\\r\\n")], seconds=5.0)
    assert run.task.entity.state is State.ERROR
'''

VEHICLE = """# {name}: swims in circles in simulation, without forces; see `shoal explain {name}`.
# For forces, navigation, control and plans: shoal new vehicle NAME --from lauv-noptilus-1

[General]
Vehicle                       = {name}

[Simulators.EstimatedState]
Enabled                       = Simulation
Entity Label                  = Simulation Engine
Pattern                       = Circle
Speed                         = 1.5
Depth                         = 2

[Simulators.IMU]
Enabled                       = Simulation

[Simulators.GPS]
Enabled                       = Simulation

[Transports.Logging]
Enabled                       = Always
Entity Label                  = Logger
"""

VARIANT = """# {name}: {base} with changes of its own; see `shoal explain {name}`.

[Require {base}.ini]

[General]
Vehicle                       = {name}
"""

VEHICLE_TEST = '''"""{name} swims."""

import subprocess
import sys
from pathlib import Path


def test_it_swims_and_leaves_a_log(tmp_path):
    command = "-m shoal.cli run {name} -p Simulation --clock virtual --for 10s --log-dir".split()
    run = [sys.executable, *command, tmp_path]
    done = subprocess.run(run, cwd=Path(__file__).parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("{name}/*/*/Data.lsf.gz"))
'''

SCENARIO = """# {name}: a dive in a current, in which the DVL falls silent. Run it: shoal test {name}.scenario.yaml
# All keys of a scenario: docs/scenarios.md; the fields of messages: shoal message EstimatedState

description: The vehicle dives and comes back; on the way it has no DVL, and so does not measure the current.
seed: 1

vehicle:
  profile: lauv-noptilus-1            # or a profile of yours: a name, or a file beside this one
  start: {{at: "41.185°, -8.7062°", heading: 90°}}
  parameters:
    Simulators.GPS: {{HACC: 3}}         # options as in a profile: shoal explain lauv-noptilus-1 Simulators.GPS
  plan:
    plan: {name}
    origin: 41.185°, -8.7062°
    maneuvers:
      - goto: {{north: 80, depth: 2, speed: 1.5}}
      - goto: {{north: 80, east: 40, depth: 2, speed: 1.5}}
      - goto: {{north: 0, east: 0, depth: 0, speed: 1.5}}

world:
  current: {{north: 0.1, east: 0.2}}    # m/s

events:
  - {{at: 60 s, silent: Simulators.DVL, for: 20 s}}

expect:
  - {{outcome: SUCCESS}}
  - {{name: dives, eventually: SimulatedState.z > 1.5 m, within: 1 min}}
  - {{name: stays_shallow, always: SimulatedState.z < 3 m}}
  - {{name: estimate_is_close, always: "distance(SimulatedState, EstimatedState) < 5 m", from: 30 s}}

metrics:
  drift: {{max: "distance(SimulatedState, EstimatedState)"}}   # m

limit: 15 min
"""


@click.group(cls=CommandGroup)
def new() -> None:
    """Create a task, a driver, a vehicle, each with a test, or a scenario, in the current folder."""


@new.command()
@click.argument("name")
def task(name: str) -> None:
    """Create a task NAME, such as DepthAlarm: a module and its test."""
    cls, module = _names(name)
    _write(Path(f"{module}.py"), TASK.format(title=cls, cls=cls))
    _write(Path(f"test_{module}.py"), TASK_TEST.format(cls=cls, module=module))
    _print_usage(cls, module)
    click.echo(f'          shoal run lauv-noptilus-1 -p Simulation --set "{module}.{cls}:Enabled=Always"')


@new.command()
@click.argument("name")
def driver(name: str) -> None:
    """Create a driver NAME of a device at a serial port, such as DepthCell: a module and its test."""
    cls, module = _names(name)
    _write(Path(f"{module}.py"), DRIVER.format(title=cls, cls=cls))
    _write(Path(f"test_{module}.py"), DRIVER_TEST.format(cls=cls, module=module))
    _print_usage(cls, module)
    settings = f'--set "{module}.{cls}:Enabled=Always" --set "{module}.{cls}:Serial Port - Device=/dev/ttyUSB0"'
    click.echo(f"          shoal run lauv-noptilus-1 -p Hardware {settings}")


def _names(name: str) -> tuple[str, str]:
    """The class and the module of a new task. Raises BadParameter."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9]*", name) or keyword.iskeyword(name):
        raise click.BadParameter(f"{name!r} is not a class name such as DepthAlarm: letters and digits only")
    cls = name[:1].upper() + name[1:]
    module = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", cls).lower()
    if module in (*PACKAGES, *sys.stdlib_module_names):
        raise click.BadParameter(f"{name!r}: there is already a module {module}")
    return cls, module


def _print_usage(cls: str, module: str) -> None:
    click.echo(f"\nTest it:  python -m pytest test_{module}.py   (pip install pytest)")
    click.echo(f"Use it:   [{module}.{cls}] with `Enabled = Always` in a profile of this folder, or for one run:")


@new.command()
@click.argument("name")
@click.option("--from", "base", metavar="PROFILE", help="Start from this one [default: a light simulation].")
@config_dir_option
def vehicle(name: str, base: str | None, config_dir: tuple[Path, ...]) -> None:
    """Create a vehicle NAME, such as lauv-mine: a profile and its test.

    A vehicle --from lauv-noptilus-1, otter, caravel or hexa-00 carries out plans.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", name):
        raise click.BadParameter(f"{name!r} is not a system name such as lauv-mine: letters, digits, - and _ only")
    if base is not None:
        try:
            load_profile(base, config_dir)
        except ProfileError as error:
            raise click.ClickException(str(error)) from None
    text = VARIANT.format(name=name, base=base.removesuffix(".ini")) if base else VEHICLE.format(name=name)
    _write(Path(f"{name}.ini"), text)
    module = re.sub(r"\W", "_", name)
    _write(Path(f"test_{module}.py"), VEHICLE_TEST.format(name=name))
    click.echo(f"\nRun it:   shoal run {name} -p Simulation")
    click.echo(f"Test it:  python -m pytest test_{module}.py   (pip install pytest)")


@new.command()
@click.argument("name")
def scenario(name: str) -> None:
    """Create a scenario NAME, such as gps-outage: a file that `shoal test` runs."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", name):
        raise click.BadParameter(f"{name!r} is not a name such as gps-outage: letters, digits, - and _ only")
    file = f"{name}.scenario.yaml"
    _write(Path(file), SCENARIO.format(name=name))
    click.echo(f"\nRun it:   shoal test {file}")
    click.echo(f"Vary it:  shoal test {file} --set world/current/north=0.5 --seed 2")
    click.echo("Test it:  python -m pytest   (pip install pytest; it runs all scenarios beside your tests)")


def _write(path: Path, text: str) -> None:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise click.ClickException(f"{path} already exists and was not changed") from None
    except OSError as error:
        raise click.ClickException(f"cannot write {path}: {error.strerror}") from None
    click.echo(f"wrote {path}")
