"""What `shoal check` accepts of the tasks that use a network or a device, a run in real time accepts, too."""

import pickle
from functools import cache

import pytest

from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.vehicle import build, check_profile, find_task
from support.diagnostics import ProfileError
from tests.command import shoal

LOCAL = (
    "Transports.UDP:Address=127.0.0.1",
    "Transports.UDP:Local Port=0",
    "Transports.TCP.Server:Address=127.0.0.1",
    "Transports.TCP.Server:Port=0",
    "Transports.FTP:Address=127.0.0.1",
    "Transports.FTP:Control Port=0",
    "Transports.Announce:Address=127.0.0.1",
    "Transports.Announce:Enable Multicast=false",
    "Transports.Announce:Enable Broadcast=false",
    "Transports.Discovery:Address=127.0.0.1",
    "Transports.MAVLink:Links=udpin://127.0.0.1:0",
    "Control.Autopilot.MAVLink:Address=udpin://127.0.0.1:0",
)
HOSTS = ("Address", "Serial Port - Device", "Links")
"""Whether there is such a host, interface or device is known only when it is opened; it is tried again then."""

TEXTS = ("???", "-1", "0", "a b, c", ",,", "x:y:z", "1e400", "nan", "99999999999", "1,2", "maybe", "ü", "9=", "=9", "")


@cache
def sections():
    """One shipped profile and mode for each task that uses a network or a device."""
    found = {}
    for profile in ("otter", "autopilot-rover", "hexa-00", "lauv-noptilus-1"):
        loaded = load_profile(profile)
        for section in loaded.config.sorted_sections():
            cls = find_task(section.name)
            for mode in ("Simulation", "Hardware"):
                if cls is not None and cls.external and loaded.is_task_enabled(section.name, {mode}):
                    found.setdefault(section.name, (profile, mode))
    return found


@cache
def local_options(profile):
    """Those of LOCAL whose section the profile has."""
    present = load_profile(profile).config.sections
    return [option for option in LOCAL if option.partition(":")[0] in present]


@cache
def local_profile(profile):
    """The profile with its local options, pickled: to read all its files takes longer than what is tested."""
    return pickle.dumps(load_profile(profile, overrides=local_options(profile)))


def mistakes(profile, mode, section, option):
    """Errors before a vehicle starts, and what fails when the task of the section starts in real time."""
    loaded = pickle.loads(local_profile(profile))
    loaded.override(option)
    loaded.raise_unused_overrides()
    loaded.raise_errors()
    problems = check_profile(loaded, {}, frozenset({mode}), find_task)
    if errors := [problem.text for problem in problems if problem.severity == "error"]:
        return errors, []
    try:
        made = build(loaded, {mode}, clock=WallClock(), keep_going=False, only=[section])
    except ProfileError as error:
        return [problem.text for problem in error.problems], []
    try:
        made.vehicle.start()
    except Exception as error:
        return [], [str(error)]
    finally:
        made.vehicle.close()
    return [], []


def test_every_kind_of_task_that_uses_a_network_is_tried():
    links = {"UDP", "TCP.Server", "FTP", "Announce", "Discovery", "MAVLink"}
    wanted = {f"Transports.{name}" for name in links} | {"Control.Autopilot.MAVLink", "Sensors.GPS"}
    assert wanted <= set(sections())


@pytest.mark.heavy
@pytest.mark.parametrize("section", sorted(sections()))
def test_no_option_fails_only_when_the_task_starts(section):
    profile, mode = sections()[section]
    refused = 0
    for parameter in find_task(section).parameters().values():
        for text in TEXTS if parameter.name not in HOSTS else ():
            before, later = mistakes(profile, mode, section, f"{section}:{parameter.name}={text}")
            assert not later, f"{parameter.name}={text}"
            refused += bool(before)
    assert refused > 5


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "mode", "option"),
    [
        ("otter", "Simulation", "Transports.MAVLink:Named Values=Nothing"),
        ("otter", "Simulation", "Transports.MAVLink:Lights=9"),
        ("hexa-00", "Simulation", "Transports.MAVLink:Buttons=sit"),
        ("hexa-00", "Hardware", "Transports.MAVLink:Video Streams=http://x"),
        ("lauv-noptilus-1", "Simulation", "Transports.UDP:Call Systems=Nobody"),
        ("caravel", "Simulation", "Transports.TCP.Server:Maximum Connections=0"),
        ("otter", "Simulation", "Transports.Announce:Multicast Address=1.2.3"),
        ("otter", "Simulation", "Transports.Discovery:Ports=70000"),
        ("otter", "Simulation", "Transports.FTP:Session Timeout=0"),
        ("otter", "Hardware", "Sensors.GPS:Serial Port - Baud Rate=fast"),
        ("autopilot-rover", "Hardware", "Control.Autopilot.MAVLink:Ending=stay"),
    ],
)
def test_check_and_run_refuse_the_same_in_real_and_in_virtual_time(profile, mode, option, tmp_path):
    local = [word for text in local_options(profile) for word in ("--set", text)]
    words = [profile, "-p", mode, *local, "--set", option]
    checked = shoal("check", *words)
    name = option.partition(":")[2].partition("=")[0]
    errors = [line for line in checked.output.splitlines() if " error: " in line and name in line]
    assert checked.exit_code == 1, checked.output
    assert errors, checked.output
    for clock in ("virtual", "real"):
        log = ["--log-dir", str(tmp_path / clock / "log")]
        run = shoal("run", *words, "--clock", clock, "--for", "0.1s", *log)
        assert run.exit_code == 2, run.output
        assert errors[0] in run.output
