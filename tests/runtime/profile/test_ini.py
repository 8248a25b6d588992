"""Ini files that include others, odd contents, and writing them back."""

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from runtime.profile import format_sections, read_config, read_sections, write_sections
from tests.runtime.profile.ini_files import read, said, values


def test_attributes_merge(tmp_path: Path) -> None:
    config = read(tmp_path, "[A]\nX {scope: plan, editable: false} = 1\nX {SCOPE: idle} = 2\nY {visibility: user}")
    x, y = config.sections["A"].options.values()
    assert (x.value, x.attributes) == ("2", {"scope": "idle", "editable": "false"})
    assert (y.value, y.attributes, y.history) == ("", {"visibility": "user"}, [])
    again = read(tmp_path, config.dump()).sections["A"].options
    assert {name: option.attributes for name, option in again.items()} == {"X": x.attributes, "Y": y.attributes}


def test_files_are_read_in_place_and_as_often_as_asked(tmp_path: Path) -> None:
    config = read(
        tmp_path,
        "[A]\nX = 1\n[Require list.ini]\n[A]\nL+ = c\n[Require list.ini]\n[A]\nL+ = d\nX+ = 3",
        list="[A]\nL = a,\n b\nX = 2",
    )
    assert values(config) == {"A": {"X": "2, 3", "L": "a, b, d"}}
    assert [Path(file).name for file in config.files] == ["main.ini", "list.ini", "list.ini"]


def test_every_value_knows_where_it_was_set(tmp_path: Path) -> None:
    main = "# title\n\n[A]\nL = z\n[Require list.ini]\n\n[A]\nL+ = c\nL- = z\nE ="
    option = read(tmp_path, main, list="[A]\nL = a").sections["A"].options["L"]
    places = [(Path(o.file).name, o.line) for o in option.contributors]
    assert places == [("list.ini", 2), ("main.ini", 8), ("main.ini", 9)]
    assert [(Path(o.file).name, o.line) for o in option.overwritten_origins] == [("main.ini", 4)]
    assert option.origin.line == 9


def test_order_of_the_file_and_of_bytes(tmp_path: Path) -> None:
    config = read(tmp_path, "[b]\n[B]\n[é]\n[a]\n[A.B/C]\n[A.B]")
    assert list(config.sections) == ["b", "B", "é", "a", "A.B/C", "A.B"]
    assert [section.name for section in config.sorted_sections()] == ["A.B", "A.B/C", "B", "a", "b", "é"]


def test_paths_are_relative_to_the_including_file(tmp_path: Path) -> None:
    (tmp_path / "etc/auv").mkdir(parents=True)
    (tmp_path / "etc/common").mkdir()
    (tmp_path / "etc/main.ini").write_text("[Require auv/basic.ini]\n")
    (tmp_path / "etc/auv/basic.ini").write_text("[Include ../common/c.ini ]\n")
    (tmp_path / "etc/common/c.ini").write_text("[A]\nX = 1\n")
    config = read_config(tmp_path / "etc/main.ini")
    assert config.value("A", "X") == "1"
    assert config.files[-1] == str(tmp_path / "etc/common/c.ini")


def test_bytes_that_are_no_text_are_kept(tmp_path: Path) -> None:
    config = read(tmp_path, b"[A\xe9]\nX = caf\xe9")
    assert b"X = caf\xe9" in config.dump().encode(errors="surrogateescape")
    assert "\\xe9" in str(read_config(tmp_path / "main.ini").problems[0]) or config.sections["A\udce9"]


def test_problems_are_fit_for_a_terminal(tmp_path: Path) -> None:
    for problem in said(read(tmp_path, b"[A]\nX + = \x1b[2J\n\x1b[31m\xe9 + = 1\n[\x1b]x")):
        assert problem.isprintable()
        problem.encode()


def test_a_missing_require_below_an_include_ends_the_included_file(tmp_path: Path) -> None:
    config = read(
        tmp_path,
        "[Include a.ini]\n[M]\nX = 1",
        a="[A]\nX = 1\n[Require b.ini]\n[A]\nX = 2",
        b="[B]\nX = 1\n[Require no.ini]\n[B]\nX = 2",
    )
    assert values(config) == {"A": {"X": "1"}, "B": {"X": "1"}, "M": {"X": "1"}}
    assert not config.errors
    assert any("b.ini:3: warning" in line and "skipped" in line for line in said(config))


def test_a_circle_names_its_chain(tmp_path: Path) -> None:
    config = read(tmp_path, "[Require a.ini]\n[M]\nX = 1", a="[Require b.ini]\n", b="[Include a.ini]\n[B]\nX = 1")
    assert values(config) == {"B": {"X": "1"}, "M": {"X": "1"}}
    chain = " → ".join(str(tmp_path / name) for name in ("main.ini", "a.ini", "b.ini", "a.ini"))
    assert chain in config.errors[0].text


def test_depth_and_number_of_files_are_bounded(tmp_path: Path) -> None:
    for index in range(80):
        (tmp_path / f"d{index}.ini").write_text(f"[Require d{index + 1}.ini]\n")
    (tmp_path / "d80.ini").write_text("[A]\nX = 1\n")
    assert "64 deep" in str(read_config(tmp_path / "d0.ini").problems)
    for index in range(40):
        (tmp_path / f"w{index}.ini").write_text(f"[Require w{index + 1}.ini]\n" * 2)
    (tmp_path / "w40.ini").write_text("")
    assert "more than 1000 files" in str(read_config(tmp_path / "w0.ini").problems)


def test_what_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.ini")
    (tmp_path / "loop.ini").symlink_to("loop.ini")
    with (tmp_path / "huge.ini").open("wb") as file:
        file.truncate(1 << 30)
    for path in (
        tmp_path,
        tmp_path / "no.ini",
        tmp_path / "pipe.ini",
        tmp_path / "loop.ini",
        tmp_path / "huge.ini",
        "\0",
    ):
        config = read_config(path)
        assert [problem.severity for problem in config.problems] == ["error"], path
        assert str(config.problems[0]).isprintable()


def test_assignments_and_warnings_are_bounded(tmp_path: Path) -> None:
    config = read(tmp_path, "[A]\nX = a\n" + "X+ = b\n" * 5000)
    assert "main.ini:1002: error: X is set more than 1000 times" in said(config)[0]
    assert len(config.value("A", "X")) == 2998
    config = read(tmp_path, "[A]\nX = a\n" + "b\n" * 50_000)
    assert "X gets longer than 65536 characters" in said(config)[0]
    config = read(tmp_path, "[A]\n" + "b\n" * 5000)
    assert len(said(config)) == 100


def test_long_lines_up_to_the_bound_are_read_and_wrapped(tmp_path: Path) -> None:
    items = ", ".join(f"Message{index}" for index in range(1000))
    config = read(tmp_path, f"[A]\nX = {items}")
    assert config.value("A", "X") == items
    dump = config.dump()
    assert max(map(len, dump.splitlines())) <= 110
    assert values(read(tmp_path, dump)) == {"A": {"X": items}}


@given(st.binary(max_size=400))
def test_arbitrary_bytes_never_raise(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    folder = tmp_path_factory.getbasetemp()
    config = read(folder, data)
    str(config.problems), config.dump()


LINE = st.one_of(
    st.text("[]{}+-=;|#,:$() AaB\t\r\udce9é", max_size=30),
    st.sampled_from(
        ["[A]", "[B]", "X = a, b", "X+ = c", "X- = b", "X + = d", "  more, text", "Y {scope: idle}", "X = $(A, X)"]
    ),
)


@pytest.mark.heavy
@settings(max_examples=300)
@given(st.lists(LINE, max_size=12))
def test_what_was_read_is_read_again_from_its_dump(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    folder = tmp_path_factory.getbasetemp()
    config = read(folder, "\n".join(lines).encode(errors="surrogateescape"))
    again = read(folder, config.dump().encode(errors="surrogateescape"))
    unsayable = {option.name for s in config.sections.values() for option in s.options.values()
                 if option.value.startswith("$(") and ("=" in option.value or "{" in option.value)}  # fmt: skip
    expected = {name: {o: v for o, v in s.items() if o not in unsayable} for name, s in values(config).items()}
    assert {name: {o: v for o, v in s.items() if o not in unsayable} for name, s in values(again).items()} == expected
    attributes = [
        {o.name: o.attributes for o in s.options.values() if o.name not in unsayable} for s in config.sorted_sections()
    ]
    assert attributes == [
        {o.name: o.attributes for o in s.options.values() if o.name not in unsayable} for s in again.sorted_sections()
    ]
    assert not again.errors


NAME = st.text(st.characters(exclude_characters="={}[]\n\0;#|", exclude_categories=["Cs"]), min_size=1, max_size=20)
VALUE = st.text(st.characters(exclude_characters="\n\0;#|", exclude_categories=["Cs"]), max_size=200).map(str.strip)


@pytest.mark.heavy
@given(st.dictionaries(NAME.map(str.strip).filter(bool), st.dictionaries(NAME.map(str.strip).filter(bool), VALUE)))
def test_what_is_written_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, sections: dict[str, dict[str, str]]
) -> None:
    path = tmp_path_factory.getbasetemp() / "written.ini"
    try:
        text = format_sections(sections)
    except ValueError:
        return
    path.write_text(text, encoding="utf-8", newline="\n")
    assert read_sections(path) == sections


@pytest.mark.parametrize(
    ("section", "option", "value"),
    [
        ("A", "X", "1\n[Transports.FTP]"), ("A", "X", "a;b"), ("A", "X", "a#b"), ("A", "X\n", "1"), ("A", "[X", "1"),
        ("A", "", "1"), ("A", "X=", "1"), ("A]", "X", "1"), ("", "X", "1"), ("Require x.ini", "X", "1"),
        ("A", "X", "$(A, b=c)"),        ("A", "X", "a" * 70_000),
    ],
)  # fmt: skip
def test_what_the_grammar_cannot_say_is_refused(section: str, option: str, value: str) -> None:
    with pytest.raises(ValueError):
        format_sections({section: {option: value}})


def test_no_file_has_no_sections(tmp_path: Path) -> None:
    assert read_sections(tmp_path / "no.ini") == {}


def test_a_written_file_replaces_the_old_one_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, synced = tmp_path / "db/auv-saved.ini", list[int]()
    monkeypatch.setattr(os, "fsync", synced.append)
    write_sections(path, {"A": {"X": "1"}})
    assert len(synced) == 3, "the folder above, the file and its folder"
    with pytest.raises(ValueError):
        write_sections(path, {"]": {"X": "2"}})
    assert read_sections(path) == {"A": {"X": "1"}}
    assert [file.name for file in path.parent.iterdir()] == ["auv-saved.ini"]
