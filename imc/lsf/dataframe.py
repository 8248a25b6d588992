"""Messages of one type as a pandas.DataFrame."""

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from imc.message import Message
from imc.schema import MessageType

if TYPE_CHECKING:
    from numpy.typing import NDArray


def to_dataframe(kind: MessageType, rows: "NDArray[Any]", objects: Iterable[Message]) -> Any:
    """Header and all fields of the messages, in the order of the schema, by time (UTC).

    `rows` and `objects` are the same messages. Raises ModuleNotFoundError, with the extra, if pandas is not installed.
    """
    try:
        pandas = import_module("pandas")
    except ModuleNotFoundError as error:
        if error.name != "pandas":
            raise
        words = "a table needs pandas: pip install pandas, or 'shoal[analysis]'"
        raise ModuleNotFoundError(words, name="pandas") from None
    names = [field.attribute for field in kind.fields]
    numbers = rows.dtype.names or ()
    decoded = list(objects) if set(names) - set(numbers) else []
    columns: dict[str, Any] = {name: rows[name].copy() for name in numbers if name not in names}
    for name in names:
        columns[name] = rows[name].copy() if name in numbers else [getattr(message, name) for message in decoded]
    times = pandas.to_datetime(columns["timestamp"], unit="s", utc=True, errors="coerce")
    return pandas.DataFrame(columns, index=pandas.DatetimeIndex(times, name="time"))
