"""Rows as an Arrow table, a Parquet file and a pandas data frame."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shoal.campaigns.jobs import ResultRow, column_names, unpack_track
from shoal.campaigns.optional_import import import_optional
from support.atomic_files import replace_file

_NUMBERS = ("margin", "seconds", "cpu", "metrics", "margins")
_TRUTHS = ("finished", "passed", "verdicts", "applied")
_KINDS = {"run": "int64", "seed": "int64", **dict.fromkeys(_NUMBERS, "float64"), **dict.fromkeys(_TRUTHS, "bool_")}
_TEXTS = ("error", "reason", "warnings", "versions", "fingerprint", "outcomes", "hashes", "logs")


def arrow_table(rows: Sequence[ResultRow], about: Mapping[str, str]) -> Any:
    """An Arrow table of rows, with `about` as its metadata. A value that a run does not have is null."""
    pa = import_optional("pyarrow")
    names = column_names(rows)
    arrays = [_array(pa, name, [row.get(name) for row in rows]) for name in names]
    return pa.table(arrays, names).replace_schema_metadata(dict(about))


def pandas_frame(rows: Sequence[ResultRow]) -> Any:
    """A pandas data frame of rows, with the number of the run as its index."""
    import_optional("pandas")
    return arrow_table(rows, {}).to_pandas().set_index("run")


def write_parquet(path: Path, rows: Sequence[ResultRow], about: Mapping[str, str]) -> None:
    """Write a Parquet file of rows in one step: the old one stays until the new one is whole. Raises OSError."""
    made = arrow_table(rows, about)
    with replace_file(path) as file:
        import_optional("pyarrow.parquet").write_table(made, file, compression="zstd")


def _array(pa: Any, name: str, values: list[Any]) -> Any:
    group = name.partition(".")[0]
    if group == "tracks":
        tracks = [None if value is None else unpack_track(value).ravel() for value in values]
        return pa.array(tracks, pa.list_(pa.float64()))
    if group in _TEXTS:
        return pa.array([None if value is None else _clean(value) for value in values], pa.string())
    if group in _KINDS:
        return pa.array(values, getattr(pa, _KINDS[group])())
    return _values(pa, values)


def _values(pa: Any, values: list[Any]) -> Any:
    """Drawn values: truths, integers, numbers, or texts if it is mixed."""
    given = [value for value in values if value is not None]
    if given and all(isinstance(value, bool) for value in given):
        return pa.array(values, pa.bool_())
    if all(isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63 for value in given):
        return pa.array(values, pa.int64())
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in given):
        return pa.array([None if value is None else float(value) for value in values], pa.float64())
    return pa.array([None if value is None else _clean(str(value)) for value in values], pa.string())


def _clean(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode()
