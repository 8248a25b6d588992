"""Text files with the messages of a log, one for each type."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TextIO

import imc
from imc.lsf import ReportProgress
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_table import MessageTable, message_table


def write_text_files(
    source: LogSource,
    path_of: Callable[[imc.MessageType], Path],
    newline: str,
    begin: Callable[[TextIO, imc.MessageType], object],
    add: Callable[[TextIO, MessageTable], object],
    progress: ReportProgress,
) -> int:
    """Write a file for each type; returns the number of rows. Raises OSError.

    begin: writes the heading. add: writes the rows of a table.
    """
    files: dict[int, TextIO] = {}
    rows = 0
    with ExitStack() as stack:
        for batch in source.batches(progress):
            for group in source.groups(batch):
                file = files.get(group.message.id)
                if file is None:
                    opened = path_of(group.message).open("w", encoding="utf-8", newline=newline)
                    file = files[group.message.id] = stack.enter_context(opened)
                    begin(file, group.message)
                table = message_table(source, batch, group)
                add(file, table)
                rows += table.rows
    return rows
