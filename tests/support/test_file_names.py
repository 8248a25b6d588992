"""Any text becomes the name of one file."""

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
