"""Key expressions that a console subscribes to."""

from collections.abc import Collection

from runtime.zenoh import key_chunk
from shoal.network.link import EVERYBODY


def key_expressions(system: str, messages: Collection[str]) -> list[str]:
    """The key expressions of messages of a system, by the chunk of its name in keys."""
    if not messages:
        return [f"imc/{system}/**", f"imc/{system}/@cmd/**"]
    return [f"imc/{system}/{way}{key_chunk(message)}/*" for message in messages for way in ("", "@cmd/")]


def includes_expression(wide: str, narrow: str) -> bool:
    """Whether a key expression of ours includes another."""
    if wide == narrow:
        return True
    of_wide, of_narrow = wide.split("/"), narrow.split("/")
    if of_wide[1] not in (EVERYBODY, of_narrow[1]):
        return False
    return (of_wide[2:] == ["**"] and of_narrow[2] != "@cmd") or of_wide[2:] == of_narrow[2:]
