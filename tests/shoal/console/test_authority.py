"""Orders of users in the log book of a vehicle."""

import pytest

from shoal.console import Authority, PageSession, Role, User

ANNA = PageSession(1, User("anna", Role.OPERATE))


@pytest.mark.parametrize(
    ("plan", "text"),
    [("survey", "survey"), ("a\nben: abort", "a\\nben: abort"), ("\x1b[2J", "\\x1b[2J"), ("\ud800", "\\ud800")],
)
def test_an_order_is_one_line_of_its_user_whatever_it_names(plan, text):
    lines = []
    authority = Authority(lambda vehicle, line: lines.append((vehicle, line)))
    authority.permit(ANNA, "lauv", "start", {"plan": plan})
    assert lines == [("lauv", "anna takes the lease"), ("lauv", f"anna: start {text}")]
