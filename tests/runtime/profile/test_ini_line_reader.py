"""The lines of an ini file: how DUNE reads them, and mistakes that DUNE does not report."""

from pathlib import Path

import pytest

from tests.outside import NO_FILE
from tests.runtime.profile.ini_files import read, said, values

GRAMMAR = {
    "assignment": ("[A]\nX = 1", {"A": {"X": "1"}}),
    "no blanks": ("[A]\nX=1", {"A": {"X": "1"}}),
    "indentation has no meaning": ("  [A]\n\n\t X = 1\n     Y = 2", {"A": {"X": "1", "Y": "2"}}),
    "carriage returns": ("[A]\r\nX = 1\r\n  2\r\n", {"A": {"X": "1 2"}}),
    "names keep blanks, signs and case": ("[A]\nSpeed -- MPS (m) = 1\nspeed -- MPS (m) = 2", None),
    "comments": ("; one\n# two\n   # three\n[A]\nX = 1", {"A": {"X": "1"}}),
    "inline comments": ("[A]\nX = 1 ; a\nY = 2 # b\nZ = 3 | c", {"A": {"X": "1", "Y": "2", "Z": "3"}}),
    "no quotes, no escapes": ('[A]\nX = "a \\n"', {"A": {"X": '"a \\n"'}}),
    "empty value": ("[A]\nX =", {"A": {"X": ""}}),
    "empty by comment": ("[A]\nX = ; none", {"A": {"X": ""}}),
    "first equals sign divides": ("[A]\nX = a = b", {"A": {"X": "a = b"}}),
    "sections merge": ("[A]\nX = 1\n[B]\n[A]\nY = 2", {"A": {"X": "1", "Y": "2"}, "B": {}}),
    "last one wins": ("[A]\nX = 1\nX = 2", {"A": {"X": "2"}}),
    "section names keep slashes and dots": ("[S.IMU/AHRS]\nX = 1", {"S.IMU/AHRS": {"X": "1"}}),
    "trailing blanks of a section": ("[A  ]\nX = 1", {"A": {"X": "1"}}),
    "no closing bracket": ("[A\nX = 1", {"A": {"X": "1"}}),
    "text behind a section": ("[A] Y = 2\nX = 1", {"A": {"X": "1"}}),
    "continuation": ("[A]\nX = a,\n    b,\nc", {"A": {"X": "a, b, c"}}),
    "continuation over comments": ("[A]\nX = a, ; first\n# no\n\n  b # second", {"A": {"X": "a, b"}}),
    "continuation of nothing": ("[A]\nX =\n  a,\n  b", {"A": {"X": "a, b"}}),
    "continuation with equals sign is an assignment": ("[A]\nX = a,\n  b = c", {"A": {"X": "a,", "b": "c"}}),
    "continuation with bracket is a section": ("[A]\nX = a,\n  [b]", {"A": {"X": "a,"}, "b": {}}),
    "continuation across a header": ("[A]\nX = a\n[B]\nb", {"A": {"X": "a"}, "B": {"X": "b"}}),
    "equals sign first is a continuation": ("[A]\nX = a\n= b", {"A": {"X": "a = b"}}),
    "extend": ("[A]\nX = a\nX+ = b\nX += c, d", {"A": {"X": "a, b", "X ": "c, d"}}),
    "extend tight": ("[A]\nX=a\nX+=b", {"A": {"X": "a, b"}}),
    "extend nothing sets": ("[A]\nX+ = b", {"A": {"X": "b"}}),
    "extend and continue": ("[A]\nX = a\nX+ = b,\n  c", {"A": {"X": "a, b, c"}}),
    "extend with attributes": ("[A]\nX = a\nX+ {scope: plan} = b", {"A": {"X": "a, b"}}),
    "reduce": ("[A]\nX = a, b, c\nX- = a", {"A": {"X": "b, c"}}),
    "reduce by several": ("[A]\nX = aa, bb, cc\nX- = aa, bb", {"A": {"X": "cc"}}),
    "reduce takes parts of items": ("[A]\nX = Rpm, MyRpm, C\nX- = Rpm", {"A": {"X": "My C"}}),
    "reduce nothing sets": ("[A]\nX- = b", {"A": {"X": "b"}}),
    "reduce and continue": ("[A]\nX = a, b\nX- = a\n, c", {"A": {"X": "b , c"}}),
    "attributes": ("[A]\nX {scope:plan} = 1", {"A": {"X": "1"}}),
    "attributes alone": ("[A]\nX = 1\nX {Scope: maneuver, visibility: user}", {"A": {"X": "1"}}),
    "reference": ("[A]\nX = 1\n[B]\nY = $(A, X)", {"A": {"X": "1"}, "B": {"Y": "1"}}),
    "reference replaces even behind +": ("[A]\nX = 1\nY = 2\nY+ = $(A,X)", {"A": {"X": "1", "Y": "1"}}),
    "reference is evaluated at once": ("[A]\nX = 1\nY = $(A, X)\nX = 2", {"A": {"X": "2", "Y": "1"}}),
    "reference only at the beginning": ("[A]\nX = 1\nY = a $(A, X)", {"A": {"X": "1", "Y": "a $(A, X)"}}),
    "no other expansion": ("[A]\nX = ${HOME}/a\nY = $(a)", {"A": {"X": "${HOME}/a", "Y": "$(a)"}}),
    "directives are case-sensitive": ("[require a.ini]\nX = 1", {"require a.ini": {"X": "1"}}),
}


@pytest.mark.parametrize("case", GRAMMAR)
def test_grammar(tmp_path: Path, case: str) -> None:
    text, expected = GRAMMAR[case]
    if expected is None:
        expected = {"A": {"Speed -- MPS (m)": "1", "speed -- MPS (m)": "2"}}
    config = read(tmp_path, text)
    assert values(config) == expected
    assert not config.errors
    assert values(read(tmp_path, config.dump())) == expected


SILENT = {
    "missing include": ("[Include no.ini]\n[A]\nX=1", f"1: warning: no.ini cannot be read: {NO_FILE}"),
    "missing require": ("\n[Require no.ini]\n[A]", f"2: error: no.ini cannot be read: {NO_FILE}"),
    "absolute path": (
        "[Require /no.ini]",
        f"1: error: no.ini cannot be read: {NO_FILE}, and it is required (the path is "
        "relative to the folder of this file)",
    ),
    "folder": ("[Include .]", "1: warning: . cannot be read: it is a folder"),
    "circle": ("[Require main.ini]", "1: error: the files include each other in a circle: main.ini → main.ini"),
    "behind a directive": (
        "[Include other.ini]\nX = 1",
        "2: warning: 'X' is set after [Include other.ini], outside any section (put a [Section] line above)",
    ),
    "lower case directive": (
        "[include other.ini]",
        "1: warning: [include other.ini] opens a section and includes nothing (write [Include FILE.ini])",
    ),
    "directive with a blank": ("[ Require other.ini]", "1: warning: [ Require other.ini] opens a section"),
    "directive with a colon": ("[Require: other.ini]", "1: warning: [Require: other.ini] opens a section"),
    "blank before a section": ("[ A]", "1: warning: the name of section [ A] begins with a blank (write [A])"),
    "open bracket": ("[A", "1: warning: [A has no closing bracket (write [A])"),
    "behind a section": ("[A] X = 1", "1: warning: 'X = 1' after the section's name is ignored"),
    "no name of a section": ("[]", "1: error: a section without a name"),
    "no section": ("# title\n\nX = 1", "3: error: 'X' is set before any section (put a [Section] line above)"),
    "no section to continue": ("hello", "1: error: 'hello' is neither a section nor an assignment"),
    "no section to describe": ("X {scope: plan}", "1: error: 'X' has attributes before any section"),
    "nothing to continue": ("[A]\nhello", "2: warning: 'hello' has no '=' and is ignored"),
    "bar": ("[A]\n| b", "2: error: a line that begins with | is neither a comment nor text"),
    "no name": ("[A]\n+ = 1", "2: warning: an assignment without a name is ignored"),
    "blank before +": ("[A]\nX + = 1", "2: warning: this sets 'X ' with the blank, not 'X' (write X+ =)"),
    "reduce nothing": ("[A]\nX- = 1", "2: warning: X was not set before, so -= sets it to '1' (write X = to set it)"),
    "reduce what is not there": (
        "[A]\nX = Rpm, Gps\nX- = Rmp",
        "3: warning: 'Rmp' is not in X (did you mean 'Rpm'?)",
    ),
    "reduce a part": (
        "[A]\nX = Rpm, MyRpm\nX- = Rpm",
        "3: warning: removing 'Rpm' from X also removes it from within 'MyRpm'",
    ),
    "continue a reduction": (
        "[A]\nX = a, b\nX- = a,\nb",
        "4: warning: 'b' is added to X, although it continues a -=",
    ),
    "extend what is empty": ("[A]\nX =\nX+ = a", "3: warning: X gets an empty item"),
    "continue across a header": (
        "[A]\nX = a\n[B]\nb",
        "4: warning: 'b' continues X into [B] (write X = in this section)",
    ),
    "comment that assigns": ("[A]\nX = a,\n b # k = 1", "3: warning: this line sets the option 'b # k'"),
    "value cut": ("[A]\nX = Motor#1", "2: warning: the value ends before '#': 'Motor'"),
    "value cut to nothing": ("[A]\nX = #ff0000", "2: warning: the value ends before '#': ''"),
    "reference to no section": (
        "[General]\nX = 1\nY = $(Genral, X)",
        "3: error: invalid reference: $(Genral, X) is not set above (did you mean 'General'?)",
    ),
    "reference to no option": (
        "[A]\nSpeed = 1\nY = $(A, Sped)",
        "3: error: invalid reference: $(A, Sped) is not set above (did you mean 'Speed'?)",
    ),
    "text behind a reference": ("[A]\nX = 1\nY = $(A, X) m", "3: warning: '$(A, X) m' is read as a reference"),
    "unknown attribute": ("[A]\nX {skope: idle} = 1", "2: warning: 'skope: idle' is not an attribute"),
    "unknown scope": (
        "[A]\nX {scope: always} = 1",
        "2: warning: scope cannot be 'always' (it can be global, idle, plan, maneuver)",
    ),
    "open brace": ("[A]\nX {scope: idle = 1", "2: warning: the attributes of X have no closing brace"),
    "sign behind attributes": ("[A]\nX {scope: idle}+ = 1", "2: warning: '+' after the attributes of X is ignored"),
    "latin-1": (
        b"[A]\n# caf\xe9\nX = caf\xe9\nY = \xe9",
        "3: warning: bytes that are not UTF-8 (and on 1 more lines) are kept as they are (save the file as UTF-8)",
    ),
    "utf-16": ("[A]\nX=1".encode("utf-16"), "1: error: the file is UTF-16 (save it as UTF-8)"),
    "byte-order mark": (b"\xef\xbb\xbf[A]\nX=1", "1: warning: a byte-order mark"),
    "nul": (b"[A]\nX = 1\x00", "2: error: a NUL byte (is this a text file?)"),
    "1 MB line": ("[A]\nX = " + "a" * (1 << 20), "2: error: the line has 1048580 bytes; 65536 are allowed"),
    "line too long for DUNE": ("[A]\nX = " + "a" * 2000, "2: warning: the line has 2004 bytes; DUNE reads 1023"),
    "garbage": (
        b"\x89PNG\r\n" + bytes(range(33, 91)) * 9 + b"\n" * 9 + b"x\n" * 99,
        "28: error: 20 errors in this file",
    ),
}


@pytest.mark.parametrize("case", SILENT)
def test_what_dune_is_silent_about_names_file_and_line(tmp_path: Path, case: str) -> None:
    text, expected = SILENT[case]
    problems = said(read(tmp_path, text, other="[O]\nX = 1"))
    assert any(problem.startswith(f"main.ini:{expected}") for problem in problems), problems


def test_clean_files_have_no_problems(tmp_path: Path) -> None:
    text = (
        "[A] ; comment\nX = 1 # one\nL = a,\n  b; two\nL+ = c\nL- = b\nY {scope: idle} = 2\nZ = $(A, X)\nU = é\nS = 1;s"
    )
    assert said(read(tmp_path, text)) == []
