"""Several processes that belong together: those of one vehicle, or of a fleet."""

from shoal.fleet.crew import run_crew
from shoal.fleet.file import FleetFileError
from shoal.fleet.keeper import Child, Keeper
from shoal.fleet.notes import end, noted, running
from shoal.fleet.ports import SYSTEM_ID, mavlink_id
from shoal.fleet.roster import Member, Roster, load_roster
from shoal.fleet.watch import View, Watch

__all__ = [
    "SYSTEM_ID",
    "Child",
    "FleetFileError",
    "Keeper",
    "Member",
    "Roster",
    "View",
    "Watch",
    "end",
    "load_roster",
    "mavlink_id",
    "noted",
    "run_crew",
    "running",
]
