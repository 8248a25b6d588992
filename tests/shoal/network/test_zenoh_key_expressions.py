"""Which subscription of a console makes another one superfluous."""

import pytest

from shoal.network.zenoh_key_expressions import includes_expression, key_expressions


@pytest.mark.parametrize(
    ("wide", "narrow", "included"),
    [
        (("*", ()), ("otter", ()), True),
        (("*", ()), ("otter", ("Abort",)), True),
        (("otter", ()), ("otter", ("Abort",)), True),
        (("*", ("Abort",)), ("otter", ("Abort",)), True),
        (("otter", ()), ("caravel", ("Abort",)), False),
        (("otter", ("Abort",)), ("otter", ()), False),
        (("*", ("Abort",)), ("otter", ("Depth",)), False),
    ],
)
def test_messages_include_those_of_one_vehicle_and_one_type(wide, narrow, included):
    plain, command = key_expressions(*narrow)
    assert includes_expression(key_expressions(*wide)[0], plain) is included
    assert not includes_expression(key_expressions(*wide)[0], command), "it is not below ** of the system"
