"""Names that DUNE's ini files use: data sections, general options and tasks."""

from collections.abc import Iterator

from runtime.profile import dune_task_names
from runtime.profile.config import Config, Section

DATA_SECTIONS = (
    "General",
    "IMC Addresses",
    "Profiles",
    "Entity Ids",
    "Zenoh",
    "Bathymetry",
    "World",
    "Evologics Addresses",
    "GSM Addresses",
    "Hardware Parts",
    "Iridium Addresses",
    "Micromodem Addresses",
    "Narrow Band Transponders",
    "Seatrac Addresses",
)
MODEL_PREFIX = "VSIM/Model/"
DATA_PREFIXES = MODEL_PREFIX, "World/"

GENERAL = {
    "Vehicle": ("", "Name of the system; [IMC Addresses] has its id."),
    "Vehicle Type": ("", "Name of the simulated model."),
    "Messages": ("", "Files with messages of your own, YAML or IMC.xml."),
    "Bus": ("", "Transport between processes: inprocess or zenoh."),
    "Network Address": ("", "Address to listen at: 127.0.0.1 for this computer only, 0.0.0.0 for all networks."),
    "Console Messages": (
        "",
        "Messages to consoles over UDP and TCP beside those listed there: NAME or NAME:HZ.",
    ),
    "Consoles": (
        "",
        "Systems that may command: NAME, NAME@ADDRESS, NAME@zenoh, and mavlink:ID for ground stations. UDP and TCP may "
        "have lists of their own.",
    ),
    "Start Time": ("", "Start of virtual time, ISO 8601."),
    "Seed": ("1", "Seed of all random numbers; recorded in a log's Config.ini."),
    "Selected": ("", "Modes selected with -p; recorded in a log's Config.ini."),
    "CPU Usage - Maximum": ("%", "Processor load that counts as too high."),
    "CPU Usage - Moving Average Samples": ("1", "Number of samples in the average of the load."),
    "Absolute Maximum Depth": ("m", "Maximum depth of the vehicle."),
    "Absolute Minimum Altitude": ("m", "Minimum altitude of the vehicle."),
    "Absolute Maximum Altitude": ("m", "Maximum altitude of an aerial vehicle."),
    "Longest Radio Gap": ("s", "How long the autopilot that is the body may be silent until a plan ends; at least 3."),
    "Underwater Depth Threshold": ("m", "Depth beyond which the vehicle counts as under water."),
    "Maximum Underwater RPMs": ("rpm", "Highest speed of the motor under water."),
    "Maximum Absolute Speed": ("m/s", "Highest speed of the vehicle."),
    "Speed Conversion -- Actuation": ("%", "Actuations of the speed model."),
    "Speed Conversion -- RPM": ("rpm", "Motor speeds of the speed model."),
    "Speed Conversion -- MPS": ("m/s", "Speeds of the speed model."),
    "Power Model -- Conversion - Watt": ("W", "Powers of the power model."),
    "Power Model -- Conversion - RPM": ("rpm", "Motor speeds of the power model."),
    "Run-Up Distance": ("m", "Distance that a start from rest costs a boat, in forecasts of plans."),
    "Time Of Arrival Factor": ("s", "Time before arrival at which a waypoint counts as near."),
    "Recovery Plan": ("", "Plan that brings the vehicle back."),
    "Battery Packs": ("1", "Number of battery packs."),
    "Battery Capacity": ("Wh", "Capacity of the batteries."),
    "Hardware List": ("", "Parts of the vehicle, named in [Hardware Parts]."),
}

PROCESS = "Process"
"""The process of the vehicle that runs the task; DUNE has none."""
EVERY_TASK = (PROCESS, "Execution Frequency", "Active", "Active - Scope", "Active - Visibility")

MULTIPLEXER = "Maneuver.Multiplexer"
# What it carries out, in the order of its entities, and the task of each here; not those of aircraft, since
# a vehicle that has Takeoff is an aircraft in Shoal.
MULTIPLEXED = {
    "IdleManeuver": "Maneuver.Idle",
    "Goto": "Maneuver.Goto",
    "Launch": "Maneuver.Launch",
    "Loiter": "Maneuver.Loiter",
    "StationKeeping": "Maneuver.StationKeeping",
    "YoYo": "Maneuver.YoYo",
    "Rows": "Maneuver.Rows",
    "FollowPath": "Maneuver.FollowPath",
    "Elevator": "Maneuver.Elevator",
    "PopUp": "Maneuver.PopUp",
    "Dislodge": "Maneuver.Dislodge",
    "ScheduledGoto": "Maneuver.ScheduledGoto",
    "Drop": "Maneuver.Drop",
    "Sample": "Maneuver.Sample",
    "StationKeepingExtended": "Maneuver.StationKeepingExtended",
}
FOR_AIRCRAFT = ("Takeoff", "Land")

TASKS = dune_task_names.TASKS.union(MULTIPLEXED.values())

LABEL = "Entity Label"


def multiplexer_option_targets(option: str) -> Iterator[tuple[str, str]]:
    """The sections and their options that an option of [Maneuver.Multiplexer] sets here; none if it sets no other's."""
    left, dashes, right = option.partition(" -- ")
    if option == "Enabled":
        yield from ((section, option) for section in MULTIPLEXED.values())
    elif dashes and left == LABEL and right in MULTIPLEXED:
        yield MULTIPLEXED[right], LABEL
    elif dashes and left in MULTIPLEXED:
        yield MULTIPLEXED[left], right


def expand_multiplexer(config: Config) -> None:
    """Add the sections that [Maneuver.Multiplexer] stands for, behind it: DUNE has one task for many maneuvers.

    A maneuver with an Enabled of its own stays as it is; any other keeps the options that it has.
    """
    multiplexer = config.sections.get(MULTIPLEXER)
    if multiplexer is None or "Enabled" not in multiplexer.options:
        return
    own = {name for name in MULTIPLEXED.values() if config.option(name, "Enabled") is not None}
    added = {
        name: config.sections.get(name) or Section(name, origins=dict(multiplexer.origins))
        for name in MULTIPLEXED.values()
        if name not in own
    }
    for option in multiplexer.options.values():
        for name, target in multiplexer_option_targets(option.name):
            if name in added:
                added[name].options.setdefault(target, option.renamed(target))
    for kind, name in MULTIPLEXED.items():
        if name in added and LABEL not in added[name].options:
            added[name].ensure_option(LABEL).set(f"{kind} Maneuver", multiplexer.origin)  # DUNE's default
    sections: dict[str, Section] = {}
    for name, section in config.sections.items():
        sections |= {name: section} if name not in added else {}
        sections |= added if section is multiplexer else {}
    config.sections = sections
