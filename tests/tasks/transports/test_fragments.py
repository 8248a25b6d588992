"""Messages in pieces, on the bus of a vehicle."""

import imc
from imc.fragments import split_packet
from runtime.testing import simulate
from tasks.transports.fragments import Fragments

CONSOLE, VEHICLE = 0x4000, 0x001A


def pieces(message, time=0.1, source=CONSOLE, target=VEHICLE, limit=64):
    packet = imc.encode(message.replace(src=VEHICLE, dst=1, timestamp=5.0))  # a source that it must not keep
    parts = split_packet(packet, limit, 7)
    return [part.replace(src=source, dst=target, timestamp=time + 0.01 * i) for i, part in enumerate(parts)]


def test_a_message_in_pieces_arrives_as_one_from_its_sender():
    request = imc.PlanDB(op=imc.PlanDB.Op.GET_STATE, plan_id="a long name " * 20)
    run = simulate(Fragments, pieces(request)[::-1], seconds=2.0)
    (found,) = run.of(imc.PlanDB)
    assert (found.src, found.dst, found.plan_id) == (CONSOLE, VEHICLE, request.plan_id)


def test_pieces_for_others_are_left_alone():
    assert not simulate(Fragments, pieces(imc.LogBookEntry(text="x" * 99), target=0x0801)).of(imc.LogBookEntry)


def test_missing_pieces_are_asked_for_once():
    parts = pieces(imc.LogBookEntry(text="x" * 200))
    run = simulate(Fragments, [parts[0], *parts[2:]], seconds=60.0, reception_timeout=10.0)
    (request,) = run.of(imc.MessagePartControl)
    assert (request.dst, request.uid, request.frag_ids) == (CONSOLE, 7, "1")
    assert len(run.task._assembler) == 0


def test_damaged_pieces_are_reported_once_of_each_sender():
    bad = imc.MessagePart(uid=1, frag_number=5, num_frags=2, data=b"x", dst=VEHICLE)
    feed = [bad.replace(src=source, timestamp=0.01 * n) for source in (CONSOLE, 0x4001) for n in range(1, 50)]
    run = simulate(Fragments, feed, seconds=2.0)
    assert [line.split(" dropped")[0] for line in run.log] == [
        "pieces of a message from 0x4000",
        "pieces of a message from 0x4001",
    ]


def test_messages_that_are_never_complete_are_counted_and_their_sender_named():
    first = imc.MessagePart(frag_number=0, num_frags=200, data=b"x" * 1000, dst=VEHICLE, src=CONSOLE)
    feed = [first.replace(uid=uid, timestamp=0.01 * uid) for uid in range(1, 101)]
    run = simulate(Fragments, feed, seconds=60.0, reception_timeout=10.0)
    assert [line for line in run.log if "lost" in line] == [
        "message in pieces from 0x4000 lost: crowded out; further ones are counted",
        "message in pieces from 0x4000 lost: never completed; further ones are counted",
    ]
    assert run.task.entity.description == "0 incomplete; 92 crowded out, 8 never completed"
