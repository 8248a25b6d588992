"""Copies a part of a log: by time, message, system and entity."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import imc
from imc.lsf import ReportProgress
from runtime.logs import KEPT, create_log, packet_blocks
from shoal.logs.selection import OwnerClock, PacketSelection, selection_mask


@dataclass
class CutReport:
    """Written content: selected packets, other packets of KEPT; and the damage, which was skipped."""

    chosen: int = 0
    kept: int = 0
    losses: list[imc.Loss] = field(default_factory=list[imc.Loss])


def cut(
    log: imc.Log, folder: Path, choice: PacketSelection, owner: int, progress: ReportProgress | None = None
) -> CutReport:
    """Copy the selected packets and those in KEPT, unchanged and in order, to a new log in `folder`.

    Only the owner's clock counts. Another system's clock may be wrong, so its packets have the time of the owner's
    packet before them. Raises FileExistsError, OSError; ValueError if nothing is selected, and then writes nothing.
    """
    done, watch = CutReport(), OwnerClock(owner)
    with create_log(folder, log) as writer:
        for block in packet_blocks(log, done.losses, progress):
            chosen = selection_mask(block.headers, choice, watch)
            kept = ~chosen & np.isin(block.headers["id"], list(KEPT))
            for index in np.flatnonzero(chosen | kept):
                writer.write(block.packets[index])
            done.chosen += int(chosen.sum())
            done.kept += int(kept.sum())
        if done.chosen == 0:
            raise ValueError("no message is selected; nothing is written")
    return done
