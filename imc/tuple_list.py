"""Parses texts of named values: IMC's unit TupleList, such as "Heading=12;Thrust=-127"."""


def parse_tuple_list(text: str) -> dict[str, str]:
    """The values by name, stripped of blanks; if a name is repeated, its last value. Never raises."""
    pairs = (pair.partition("=") for pair in text.split(";") if pair.strip())
    return {name.strip(): value.strip() for name, _, value in pairs}


def parse_tuple_list_integer(text: str, name: str) -> int | None:
    """The integer with a name, as in "src=16385" or "src=0x4001"; None if it is missing or not an integer."""
    try:
        return int(parse_tuple_list(text).get(name, ""), 0)
    except ValueError:
        return None
