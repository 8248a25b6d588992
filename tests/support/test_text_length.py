"""Cut texts fit their length, stay readable, and show that they are cut."""

from hypothesis import given
from hypothesis import strategies as st

from support.text_length import clip, clip_utf8, list_first


@given(st.text(), st.integers(1, 30))
def test_a_clipped_text_fits_and_shows_the_cut(text: str, longest: int):
    cut = clip(text, longest)
    assert len(cut) <= longest
    assert cut == text or (cut.endswith("…") and text.startswith(cut[:-1]))


@given(st.text(st.characters(codec=None)), st.integers(3, 30), st.sampled_from(["", "…"]))
def test_clipped_bytes_fit_and_keep_whole_characters(text: str, longest: int, mark: str):
    cut = clip_utf8(text, longest, mark)
    assert len(cut.encode()) <= longest
    readable = text.encode(errors="replace").decode()
    assert cut == readable or (cut.endswith(mark) and readable.startswith(cut.removesuffix(mark)))


def test_a_list_shows_how_many_are_left_out():
    assert list_first([], 2) == ""
    assert list_first(["a", "b"], 2) == "a, b"
    assert list_first({"a": 1, "b": 2, "c": 3, "d": 4}, 2, "; ") == "a; b and 2 more"
