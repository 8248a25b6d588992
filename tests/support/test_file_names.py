"""Any text becomes the name of one file."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.file_names import LONGEST, file_name_of, file_name_part


@given(st.text())
def test_a_part_of_a_name_is_short_and_has_no_separators(text: str):
    part = file_name_part(text)
    assert len(part.encode()) <= LONGEST
    assert not set(part) & set('/\\:\0 \n\t*?"<>|;')


@given(st.text())
def test_a_name_is_never_empty_or_hidden(text: str):
    name = file_name_of(text)
    assert name
    assert name[0] != "."


@pytest.mark.parametrize("text", [". ..", " . . ", ".. ..", ".\u3000..", ".\n../x"])
def test_a_name_leads_to_no_other_folder(text: str):
    assert file_name_of(text).startswith("_")
    assert file_name_of(text) not in (".", "..")


def test_dots_in_front_do_not_count_as_part_of_a_long_name():
    assert file_name_of("." * LONGEST + "lauv") == "lauv"
