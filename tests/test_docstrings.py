"""Docstrings of modules, classes, functions and constants begin with a verb or a noun."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("autonomy", "bench", "imc", "mavlink", "runtime", "shoal", "support", "tasks", "world")
HEADLESS = (
    *("What", "Whatever", "Who", "Whom", "Whose", "Where", "How", "Which", "When", "Why"),
    *("As", "By", "From", "In", "Of", "That", "There", "Those", "Says", "Tells", "Somebody", "Nobody"),
    *("About", "Above", "After", "Along", "At", "Before", "Below", "Between", "For", "If", "Like", "On", "Through"),
    *("To", "Until", "With", "Without", "Also", "Not", "Once", "Only", "Be", "Have", "Its", "Our", "They", "It"),
    *("Anything", "Everything", "None", "Nothing", "Something"),
)
SUBJECTS = ("Whether it ", "Whether they ", "Whether there ")


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Lines and texts of the strings that stand as statements, also those below constants."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield node.lineno, text.strip()
            case _:
                pass


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_begin_with_a_verb_or_a_noun(package: str) -> None:
    found = 0
    headless: list[str] = []
    for path in sorted((REPOSITORY / package).rglob("*.py")):
        for line, text in _docstrings(ast.parse(path.read_text(encoding="utf-8"))):
            found += 1
            if text.split(" ", 1)[0].rstrip(",:") in HEADLESS or text.startswith(SUBJECTS):
                headless.append(f"{path.relative_to(REPOSITORY)}:{line}: {text.splitlines()[0]}")
    assert found
    assert not headless, "\n".join(headless)
