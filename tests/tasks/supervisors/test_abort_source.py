"""The name of the console that has sent an Abort, in the log."""

from flying import CCU

import imc
from runtime.testing import simulate
from tasks.supervisors.vehicle import Vehicle


def test_an_abort_has_the_name_with_which_its_console_has_announced_itself():
    names = {CCU: "shoal-ana@boat", 0x1B: "another"}
    named = [imc.Announce(timestamp=2.0, src=src, sys_name=name) for src, name in names.items()]
    run = simulate(Vehicle, feed=[*named, imc.Abort(timestamp=4.5, src=CCU, src_ent=7)], seconds=8.0)
    (line,) = [entry.text for entry in run.of(imc.LogBookEntry) if "abort" in entry.text]
    assert line == f"got abort request from system shoal-ana@boat - {CCU} @ 7"
