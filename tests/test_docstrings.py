"""Docstrings of classes and functions begin with a verb or a noun."""

import ast
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
HEADLESS = ("What", "Who", "Whom", "Where", "How", "Which")


@pytest.mark.parametrize("package", ["runtime", "tasks"])
def test_docstrings_begin_with_a_verb_or_a_noun(package: str) -> None:
    headless: list[str] = []
    for path in sorted((REPOSITORY / package).rglob("*.py")):
        if "mavlink" in str(path.relative_to(REPOSITORY)):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                continue
            text = ast.get_docstring(node) or ""
            if text.split(" ", 1)[0].rstrip(",") in HEADLESS:
                headless.append(f"{path.relative_to(REPOSITORY)}:{node.lineno}: {node.name}: {text.splitlines()[0]}")
    assert not headless, "\n".join(headless)
