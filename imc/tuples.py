"""Texts of named values: IMC's unit TupleList, "Heading=12;Thrust=-127"."""


def read_tuples(text: str) -> dict[str, str]:
    """The values by name, without blanks around them; of a name that is there twice the last. Never raises."""
    pairs = (pair.partition("=") for pair in text.split(";") if pair.strip())
    return {name.strip(): value.strip() for name, _, value in pairs}


def whole_number(text: str, name: str) -> int | None:
    """The number of a name, "src=16385" or "src=0x4001"; None where there is none."""
    try:
        return int(read_tuples(text).get(name, ""), 0)
    except ValueError:
        return None
