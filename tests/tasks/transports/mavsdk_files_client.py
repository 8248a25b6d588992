"""A MAVSDK program that takes files: the port and a folder for them are its arguments; it prints what it found."""

import sys
from pathlib import Path

from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.plugins.ftp import FtpError
from mavsdk_program import run


async def take(system, folder):
    files, logs = FtpAsync(system), LogFilesAsync(system)
    found = await files.list_directory("/logs/20240102/030405_dive")
    seen = {"files": [[e.name, e.size_bytes, e.modification_time_s] for e in found.entries]}
    for burst in (True, False):
        place = folder / str(burst)
        place.mkdir()
        async for _ in files.download("/logs/20240102/030405_dive/Data.lsf", str(place), burst):
            pass
    seen["same"] = await files.are_files_identical(
        str(folder / "True" / "Data.lsf"), "/logs/20240102/030405_dive/Data.lsf"
    )
    try:
        await files.remove_file("/logs/20240102/030405_dive/Data.lsf")
    except FtpError as error:
        seen["refused"] = str(error)
    entries = await logs.get_entries()
    seen["logs"] = [[entry.id, entry.date, entry.size_bytes] for entry in entries]
    async for _ in logs.download_log_file(entries[0], str(folder / "log")):
        pass
    return seen


run(lambda system: take(system, Path(sys.argv[2])))
