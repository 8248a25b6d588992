"""Orders of users in the log book of a vehicle."""

import pytest

from shoal.console import Authority, AuthorityError, PageSession, Role, User

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


def test_an_unknown_order_takes_no_lease():
    lines = []
    authority = Authority(lambda vehicle, line: lines.append(line))
    with pytest.raises(AuthorityError, match="no such order: 'dive'"):
        authority.permit(ANNA, "lauv", "dive", {})
    assert lines == []
    assert authority.leases.view() == {}
