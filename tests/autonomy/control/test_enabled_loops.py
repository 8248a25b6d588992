"""Loops that messages enable and disable."""

import imc
from autonomy.control import EnabledLoops

Mask = imc.CLoopsMask


def loops(enable, mask, scope):
    return imc.ControlLoops(enable=enable, mask=mask, scope_ref=scope)


def test_loops_are_enabled_and_disabled():
    tested = EnabledLoops(Mask.YAW | Mask.DEPTH)
    assert tested.receive(loops(1, Mask.YAW | Mask.SPEED, 1))
    assert tested.mask == Mask.YAW
    assert not tested.receive(loops(1, Mask.YAW, 1))
    assert tested.receive(loops(0, Mask.ALL, 2))
    assert tested.mask == 0


def test_loops_of_an_older_scope_come_too_late():
    tested = EnabledLoops(Mask.YAW)
    assert tested.receive(loops(1, Mask.YAW, 5))
    assert not tested.receive(loops(0, Mask.ALL, 4))
    assert tested.mask == Mask.YAW
