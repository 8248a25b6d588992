"""The mission of a vehicle: its items, its upload and download, and its plans on board."""

from mavlink.vehicle.mission.plan_client import OnReply, PlanClient, PlanReply
from mavlink.vehicle.mission.store import NO_PLAN, REST_SUFFIX, MissionState, MissionStore
from mavlink.vehicle.mission.transfer import MissionTransfer, acknowledge, seq_to_item_number

__all__ = [
    "NO_PLAN",
    "REST_SUFFIX",
    "MissionState",
    "MissionStore",
    "MissionTransfer",
    "OnReply",
    "PlanClient",
    "PlanReply",
    "acknowledge",
    "seq_to_item_number",
]
