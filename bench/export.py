"""Compares Shoal's export to MCAP with the `mcap` package writing the same messages as JSON.

Run it on a quiet machine: `python bench/export.py LOG`, with any log, or one from `bench/make_log.py`. Both read the
log with imc.Log, check CRCs and compress with zstd; they run alternately, and the best time counts. A ratio above 1
means that Shoal is faster. Shoal's export also has the packets, and poses, positions and texts for viewers.
"""

import argparse
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import msgspec
from mcap.writer import Writer

import imc
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.csv import export_csv
from shoal.logs.export.mcap import export_mcap
from shoal.logs.export.netcdf import export_netcdf
from shoal.logs.export.parquet import export_parquet

ROUNDS = 3


def shoal(log: Path, out: Path) -> None:
    """Export as `shoal log export` does."""
    opened = imc.Log(log)
    export_mcap(LogSource(opened, summarize(opened)), out)


def shoal_messages_only(log: Path, out: Path) -> None:
    """The same without the packets."""
    opened = imc.Log(log)
    export_mcap(LogSource(opened, summarize(opened)), out, raw=False)


def netcdf(log: Path, out: Path) -> None:
    """All messages as NetCDF."""
    opened = imc.Log(log)
    export_netcdf(LogSource(opened, summarize(opened)), out)


def folder(export: Callable[[LogSource, Path], int]) -> Callable[[Path, Path], None]:
    """An export that writes many files."""

    def run(log: Path, out: Path) -> None:
        opened = imc.Log(log)
        out.mkdir(exist_ok=True)
        export(LogSource(opened, summarize(opened)), out)

    return run


def json_with(dump: Callable[[imc.Message], bytes]) -> Callable[[Path, Path], None]:
    """The mcap package's writer, one channel per system, message and entity."""

    def run(log: Path, out: Path) -> None:
        with out.open("wb") as file:
            writer = Writer(file)
            writer.start("", "bench")
            schemas: dict[str, int] = {}
            channels: dict[tuple[str, int, int], int] = {}
            for message in imc.Log(log):
                name = type(message).__name__
                key = name, message.src, message.src_ent
                if key not in channels:
                    if name not in schemas:
                        schemas[name] = writer.register_schema(name, "jsonschema", b'{"type": "object"}')
                    topic = f"/{message.src}/{name}/{message.src_ent}"
                    channels[key] = writer.register_channel(topic, "json", schemas[name])
                time = int(message.timestamp * 1e9)
                writer.add_message(channels[key], time, dump(message), time)
            writer.finish()

    return run


SIDES: dict[str, Callable[[Path, Path], None]] = {
    "Shoal: messages, packets, well-known types": shoal,
    "Shoal without the packets": shoal_messages_only,
    "mcap, JSON by json.dumps": json_with(lambda message: json.dumps(message.to_dict(), default=str).encode()),
    "mcap, JSON by msgspec": json_with(msgspec.json.Encoder(enc_hook=str).encode),
    "(Shoal, NetCDF)": netcdf,
    "(Shoal, Parquet)": folder(export_parquet),
    "(Shoal, CSV)": folder(export_csv),
}


def measure(log: Path) -> dict[str, tuple[float, int]]:
    """Best CPU time (s) and size (bytes) of each side."""
    found: dict[str, tuple[float, int]] = {}
    with tempfile.TemporaryDirectory() as place:
        for _ in range(ROUNDS):
            for number, (name, run) in enumerate(SIDES.items()):
                out = Path(place, str(number))
                begin = process_time()
                run(log, out)
                taken = process_time() - begin
                files = out.iterdir() if out.is_dir() else [out]
                size = sum(file.stat().st_size for file in files)
                found[name] = min(found.get(name, (taken, size)), (taken, size))
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    log = parser.parse_args().log
    count = len(imc.Log(log))
    found = measure(log)
    ours = found[next(iter(SIDES))][0]
    print(f"{count} messages of {log}\n{'':44}{'µs/message':>12}{'MB':>9}{'ratio':>9}")
    for name, (taken, size) in found.items():
        print(f"{name:44}{taken / count * 1e6:12.2f}{size / 1e6:9.1f}{taken / ours:9.2f}")


if __name__ == "__main__":
    main()
