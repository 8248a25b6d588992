"""Pictures go to those who have asked, whatever others ask in false names."""

import imc
from tasks.transports.imc_links.large_answers import ASKED, MOST_PEERS, MOST_REQUESTS, LargeAnswers

VEHICLE, CONSOLE = 0x1A, 0x4001
PICTURE = imc.CompressedImage(src=VEHICLE, dst=0xFFFF)


def request(source: int = CONSOLE, vehicle: int = VEHICLE) -> imc.ImageTxSettings:
    return imc.ImageTxSettings(src=source, dst=vehicle)


def test_who_has_asked_gets_pictures_for_five_seconds() -> None:
    answers = LargeAnswers()
    answers.on_request(request(), 10.0, "10.0.0.7")
    answers.on_request(request(0x4002, vehicle=0x1B), 10.0, "10.0.0.7")
    assert answers.receivers(PICTURE, 10.0 + ASKED) == {CONSOLE}
    assert answers.receivers(PICTURE, 10.1 + ASKED) == set()


def test_requests_in_false_names_keep_no_other_peer_from_its_pictures() -> None:
    answers = LargeAnswers()
    answers.on_request(request(), 10.0, "10.0.0.7")
    for number in range(10_000):
        answers.on_request(request(number % 0x4000, vehicle=number), 10.0, "10.0.0.66")
        answers.on_request(request(number % 0x4000, vehicle=number), 10.0)
    assert CONSOLE in answers.receivers(PICTURE, 11.0)
    answers.on_request(request(0x4002), 11.0, "10.0.0.8")
    assert {CONSOLE, 0x4002} <= set(answers.receivers(PICTURE, 11.0))


def test_the_newest_requests_of_a_peer_count() -> None:
    answers = LargeAnswers()
    for number in range(MOST_REQUESTS + 5):
        answers.on_request(request(0x4100 + number), 10.0, "10.0.0.7")
        answers.on_request(request(0x4100), 10.0, "10.0.0.7")
    found = answers.receivers(PICTURE, 10.0)
    assert len(found) == MOST_REQUESTS
    assert {0x4100, 0x4100 + MOST_REQUESTS + 4} <= set(found)


def test_of_too_many_peers_the_one_that_has_asked_longest_ago_gives_way() -> None:
    answers = LargeAnswers()
    for number in range(MOST_PEERS + 1):
        answers.on_request(request(0x4100 + number), 10.0, f"10.0.0.{number}")
    assert answers.receivers(PICTURE, 10.0) == set(range(0x4101, 0x4101 + MOST_PEERS))
