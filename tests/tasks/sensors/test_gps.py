"""GPS receivers: a recorded stream, UBX, damage, and a pseudo terminal on the shipped profile."""

import math
import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyubx2 import UBXMessage

import imc
from runtime import State
from runtime.testing import START, Run, simulate
from tasks.sensors.gps import GPS

DATA = Path(__file__).parents[2] / "data" / "sensors" / "gps.nmea"
LINES = DATA.read_bytes().splitlines(keepends=True)
Valid = imc.GpsFix.Validity
Type = imc.GpsFix.Type
MOVING = Valid(0x1FF)
MOMENT = [
    "GPGGA,092725.00,4717.11399,S,00833.91590,W,1,08,1.01,499.6,M,48.0,M,,",
    "GPVTG,77.52,T,,M,1.944,N,3.6,K,A",
    "GPZDA,092725.00,04,03,2026,00,00",
]


def timed(lines: list[bytes]) -> Iterator[tuple[float, bytes]]:
    """Each line at the second of its moment, which begins with RMC."""
    second = -1.0
    for line in lines:
        second += b"RMC," in line
        yield max(second, 0.0), line


def sentence(content: str) -> bytes:
    check = 0
    for byte in content.encode():
        check ^= byte
    return f"${content}*{check:02X}\r\n".encode()


def fixes(run: Run) -> list[imc.GpsFix]:
    return run.of(imc.GpsFix)


def of(*contents: str, **parameters: object) -> list[imc.GpsFix]:
    """The fixes of sentences that arrive at once."""
    return fixes(simulate(GPS, stream=b"".join(map(sentence, contents)), **parameters))


def test_a_recorded_stream_gives_a_fix_a_second_from_start_to_motion() -> None:
    run = simulate(GPS, stream=list(timed(LINES)))
    found = fixes(run)
    assert [round(fix.timestamp - START) for fix in found] == list(range(20))
    assert [Valid(fix.validity) for fix in found[:4]] == [
        Valid(0),
        Valid(0),
        Valid.VALID_DATE | Valid.VALID_TIME,
        MOVING & ~Valid.VALID_COG,
    ]
    last = found[-1]
    assert Valid(last.validity) == MOVING
    assert last.type == Type.STANDALONE
    assert (last.utc_year, last.utc_month, last.utc_day, last.utc_time) == (2026, 4, 7, 37819.0)
    assert math.degrees(last.lat) == pytest.approx(41.185098, abs=1e-6)
    assert math.degrees(last.lon) == pytest.approx(-8.706111, abs=1e-6)
    assert last.height == pytest.approx(1.5 + 54.6, abs=0.01)  # above the ellipsoid
    assert (last.sog, last.cog) == pytest.approx((1.2, 0.6), abs=1e-3)
    assert last.satellites == 11
    assert (last.hdop, last.vdop, last.hacc, last.vacc) == pytest.approx((0.98, 1.39, 0.72, 1.0), abs=0.01)
    assert run.task.entity.description == "11 satellites"
    assert run.log == []


def test_it_is_the_same_in_any_portions() -> None:
    wanted = [fix.replace(timestamp=0.0) for fix in fixes(simulate(GPS, stream=DATA))]
    data = DATA.read_bytes()
    pieces = [(at / 1000.0, data[at : at + 7]) for at in range(0, len(data), 7)]
    assert [fix.replace(timestamp=0.0) for fix in fixes(simulate(GPS, stream=pieces))] == wanted
    assert len(wanted) == 20


def test_the_end_of_a_moment_is_learned_so_fixes_are_not_late() -> None:
    stream = [
        (float(second), sentence(words.replace("0927", f"{second:02d}27"))) for second in range(4) for words in MOMENT
    ]
    found = fixes(simulate(GPS, stream=stream, seconds=10.0))
    assert [round(fix.timestamp - START) for fix in found] == [0, 1, 2, 3]


def test_the_last_sentence_may_be_given_as_in_dune() -> None:
    (fix,) = of(*MOMENT, sentence_order=["GPGGA", "GPVTG", "GPZDA"])
    assert (math.degrees(fix.lat), math.degrees(fix.lon)) == pytest.approx((-47.2852332, -8.5652650), abs=1e-6)
    assert (fix.utc_year, fix.utc_time) == (2026, 34045.0)
    assert (fix.sog, fix.cog) == pytest.approx((1.0, math.radians(77.52)), abs=1e-3)
    assert of(*MOMENT) == []  # nobody knows yet that nothing else comes


@pytest.mark.parametrize(
    ("words", "valid", "kind"),
    [
        ("GNRMC,092725.00,A,4717.1,N,00833.9,E,0.1,,040326,,,A", True, Type.STANDALONE),
        ("GNRMC,092725.00,V,4717.1,N,00833.9,E,0.1,,040326,,,N", False, Type.STANDALONE),
        ("GNRMC,092725.00,A,4717.1,N,00833.9,E,0.1,,040326,,,D", True, Type.DIFFERENTIAL),
        ("GNRMC,092725.00,A,4717.1,N,00833.9,E,0.1,,040326,,,E", True, Type.DEAD_RECKONING),
        ("GPGGA,092725.00,4717.1,N,00833.9,E,2,08,1.01,499.6,M,48.0,M,,", True, Type.DIFFERENTIAL),
        ("GPGGA,092725.00,4717.1,N,00833.9,E,0,00,99.99,,M,,M,,", False, Type.STANDALONE),
        ("GPGGA,092725.00,4717.1,N,00833.9,E,6,08,1.01,499.6,M,48.0,M,,", True, Type.DEAD_RECKONING),
        ("GNGNS,092725.00,4717.1,N,00833.9,E,AANN,10,0.9,499.6,48.0,,,V", True, Type.STANDALONE),
        (
            "PUBX,00,081350.00,4717.1,N,00833.9,E,546.6,D3,2.1,2.0,3.6,77.5,0.0,,0.92,1.19,0.77,9,0,0",
            True,
            Type.DIFFERENTIAL,
        ),
        (
            "PUBX,00,081350.00,4717.1,N,00833.9,E,546.6,NF,2.1,2.0,3.6,77.5,0.0,,0.92,1.19,0.77,0,0,0",
            False,
            Type.STANDALONE,
        ),
    ],
)
def test_each_sentence_says_whether_and_how_the_position_is_known(words: str, valid: bool, kind: Type) -> None:
    (fix,) = of(words, sentence_order=[words.partition(",")[0]])
    assert bool(fix.validity & Valid.VALID_POS) is valid
    assert fix.type == kind
    assert (fix.lat != 0.0) is valid


def test_an_unknown_height_is_not_zero_and_the_last_one_counts_for_a_while() -> None:
    rmc, gga = (
        "GPRMC,12{0:04d},A,4110.0,N,00842.0,W,2.0,90.0,010126,,,A",
        "GPGGA,12{0:04d},4110.0,N,00842.0,W,1,08,0.9,{1},M,,",
    )
    moments = [rmc.format(0), gga.format(1, "100.0,M,50.0"), rmc.format(2), rmc.format(20), rmc.format(21)]
    stream = [(float(int(text[8:12])), sentence(text)) for text in moments]
    heights = [
        fix.height for fix in fixes(simulate(GPS, stream=stream, keep_going=True)) if fix.validity & Valid.VALID_POS
    ]
    assert heights == pytest.approx([math.nan, 150.0, 150.0, math.nan, math.nan], nan_ok=True)


def test_a_height_above_the_sea_is_not_taken_for_one_above_the_ellipsoid() -> None:
    def gga(second: int, separation: str) -> str:
        return f"GPGGA,1200{second:02d},4110.0,N,00842.0,W,1,08,0.9,100.0,M,{separation},M,,"

    found = of(gga(0, ""), gga(1, "50.0"), gga(2, ""), gga(3, "51.0"), gga(4, ""))
    assert [fix.height for fix in found] == pytest.approx([math.nan, 150.0, 150.0, 151.0, 151.0], nan_ok=True)


def test_speed_and_date_that_come_seldom_are_in_the_next_fix() -> None:
    stream = []
    for step in range(20):
        second, tenth = divmod(step * 2, 10)
        text = sentence(f"GPGGA,1200{second:02d}.{tenth}0,4110.0,N,00842.0,W,1,08,0.9,100.0,M,50.0,M,,")
        if not tenth:
            text += sentence(f"GPRMC,1200{second:02d}.00,A,4110.0,N,00842.0,W,2.0,90.0,010126,,,A")
        stream.append((second + tenth / 10, text))
    found = fixes(simulate(GPS, stream=stream))
    speeds = [fix for fix in found if fix.validity & Valid.VALID_SOG]
    assert (len(found), len(speeds)) == (20, 4)
    assert {(round(fix.sog, 2), fix.utc_year, fix.validity & Valid.VALID_DATE) for fix in speeds} == {(1.03, 2026, 1)}
    assert [fix.utc_time for fix in found] == sorted({fix.utc_time for fix in found})


def test_damaged_sentences_are_left_out_and_counted() -> None:
    damaged = [line.replace(b"4111", b"4211", 1) if b"GGA" in line else line for line in LINES]
    run = simulate(GPS, stream=list(timed(damaged)))
    assert len(fixes(run)) == 20
    assert not any(math.degrees(fix.lat) > 41.5 for fix in fixes(run))
    assert run.task.receiver.bad == 17
    assert run.task.entity.description == "0 satellites; 17 bad sentences"
    assert len(run.log) == 2, "the 1st and the 10th"


def test_half_a_sentence_costs_no_other() -> None:
    rmc = next(line for line in LINES if b"RMC,103019" in line)
    run = simulate(GPS, stream=rmc[:30] + rmc + b"\xb5\x62\x01\x07\xff\xff" + rmc, sentence_order=["GNRMC"])
    assert len(fixes(run)) == 2


def test_impossible_values_are_bad_sentences() -> None:
    wrong = ["GNRMC,092725.00,A,9917.1,N,00833.9,E,0.1,,040326,,,A", "GPZDA,092725.00,99,99,2026,00,00"]
    run = simulate(GPS, stream=b"".join(map(sentence, wrong)))
    assert fixes(run) == []
    assert run.task.receiver.bad == 2


def test_a_receiver_of_before_nmea_2_3_has_no_mode_in_its_sentences() -> None:
    (fix,) = of("GPRMC,092725.00,A,4717.1,N,00833.9,E,2.0,90.0,040326,,", sentence_order=["GPRMC"])
    assert (Valid(fix.validity) & Valid.VALID_POS, fix.type) == (Valid.VALID_POS, Type.STANDALONE)


def test_a_short_sentence_or_message_is_no_mistake_of_the_driver() -> None:
    kinds = [line.split(b"*")[0][1:].decode() for line in LINES[:40]]
    kinds += [
        *MOMENT,
        "GPGST,092725.00,1,1,1,1,1,1,1",
        "PUBX,00,092725.00,4717.1,N,00833.9,E,60,G3,1,2,3,4,5,,1,1,1,8,0,0",
    ]
    short = [",".join(kind.split(",")[:count]) for kind in kinds for count in range(1, kind.count(",") + 1)]
    short.append(f"GPZDA,092725.00,{'9' * 30},11,2026,00,00")
    nothing = pvt()[:4] + b"\0\0\x08\x19"  # a question for NAV-PVT
    run = simulate(GPS, stream=b"".join(map(sentence, short)) + nothing + sentence(MOMENT[0]) + sentence(MOMENT[1]))
    assert "restarting" not in run.log
    assert run.task.receiver.bad >= 1
    assert fixes(run)[-1].satellites == 8


def pvt(**fields: object) -> bytes:
    usual = {
        **{"year": 2026, "month": 4, "day": 7, "hour": 10, "min": 30, "second": 5, "nano": -500_000_000},
        **{"validDate": 1, "validTime": 1, "gnssFixOk": 1, "fixType": 3, "numSV": 14, "lat": 41.185, "lon": -8.7062},
        **{"height": 56_100, "hAcc": 1500, "vAcc": 2500, "gSpeed": 1200, "headMot": 270.0},
    }
    return UBXMessage("NAV", "NAV-PVT", 0, **(usual | fields)).serialize()


def test_ubx_has_all_in_one_message_and_goes_before_nmea() -> None:
    dop = UBXMessage("NAV", "NAV-DOP", 0, hDOP=0.8, vDOP=1.3).serialize()
    nmea = b"".join(map(sentence, MOMENT))
    run = simulate(GPS, stream=[(1.0, dop + pvt() + nmea), (2.0, pvt(diffSoln=1) + nmea)], sentence_order=["GPZDA"])
    first, second = fixes(run)
    assert Valid(first.validity) == MOVING
    assert (first.utc_year, first.utc_month, first.utc_day, first.utc_time) == (2026, 4, 7, 37804.5)
    assert (math.degrees(first.lat), math.degrees(first.lon)) == pytest.approx((41.185, -8.7062), abs=1e-7)
    assert (first.height, first.hacc, first.vacc) == pytest.approx((56.1, 1.5, 2.5), abs=1e-3)
    assert (first.sog, first.cog) == pytest.approx((1.2, -math.pi / 2.0), abs=1e-3)
    assert (first.hdop, first.vdop, first.satellites) == pytest.approx((0.8, 1.3, 14), abs=1e-3)
    assert (first.type, second.type) == (Type.STANDALONE, Type.DIFFERENTIAL)


def test_a_ubx_fix_that_is_not_ok_has_no_position() -> None:
    (fix,) = fixes(simulate(GPS, stream=pvt(gnssFixOk=0, fixType=0)))
    assert Valid(fix.validity) == Valid.VALID_DATE | Valid.VALID_TIME
    assert (fix.lat, fix.lon) == (0.0, 0.0)


def test_a_damaged_ubx_message_is_counted_and_the_next_one_is_taken() -> None:
    run = simulate(GPS, stream=pvt()[:50] + b"\x00" + pvt()[51:] + pvt())
    assert len(fixes(run)) == 1
    assert run.task.receiver.bad >= 1


def described(stream: list[tuple[float, bytes]]) -> str:
    """What the driver says at the end of a stream."""
    return simulate(GPS, stream=stream, port="/dev/ttyS9", keep_going=True).task.entity.description


def test_a_receiver_that_sends_something_else_is_reported_as_that() -> None:
    old = described([(i, f"$GPGGA,12000{i},4110.0,N,00842.0,W,1,08,0.9,9.0,M,50.0,M,,\r\n".encode()) for i in range(8)])
    assert old == "/dev/ttyS9: sentences have no checksum (GPGGA), and are left out: make the receiver send *hh"
    frame = bytearray(b"\x01\x06" + (52).to_bytes(2, "little") + bytes(52))
    first = second = 0
    for byte in frame:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    binary = b"\xb5\x62" + bytes(frame) + bytes((first, second))
    enable = "received, but no fix: enable NAV-PVT, or the sentences GGA and RMC"
    assert described([(i, binary) for i in range(8)]) == f"/dev/ttyS9: UBX NAV-SOL {enable}"
    place = sentence("GPGLL,4916.45,N,12311.12,W,225444,A,A") + sentence("HEHDT,10.0,T")
    assert described([(i, place) for i in range(8)]) == f"/dev/ttyS9: GPGLL, HEHDT {enable}"
    assert "baud rate" in described([(i, b"\x80\x99\x12" * 20) for i in range(8)])


def test_headings_and_turn_rates_are_published_and_what_they_do_not_say_is_unknown() -> None:
    contents = ["HEHDT,274.07,T", "HCHDM,90.0,M", "HCHDG,98.3,0.5,E,12.6,W", "GPTHS,123.4,A", "GPTHS,1.0,V", "HEHDT,,T"]
    contents += ["HEROT,-30.0,A", "HEROT,5.0,V"]
    run = simulate(GPS, stream=b"".join(map(sentence, contents)))
    found = run.of(imc.EulerAngles)
    assert all(math.isnan(angles.phi) and math.isnan(angles.theta) for angles in found)
    assert [round(math.degrees(angles.psi), 2) for angles in found if angles.psi == angles.psi] == [-85.93, 86.2, 123.4]
    magnetic = [math.degrees(angles.psi_magnetic) for angles in found]
    assert [round(value, 2) for value in magnetic if value == value] == [90.0, 98.8]
    (rates,) = run.of(imc.AngularVelocity)
    assert rates.z == pytest.approx(math.radians(-0.5))
    assert math.isnan(rates.x)
    assert not fixes(run)


def test_a_receiver_that_falls_silent_or_is_unplugged_is_an_error() -> None:
    run = simulate(GPS, stream=[*timed(LINES), (30.0, None), (35.0, LINES[3])], seconds=36.0, port="/dev/ttyS9")
    found = [(round(m.timestamp - START), State(m.state), m.description) for m in run.of(imc.EntityState)]
    assert (24, State.ERROR, "/dev/ttyS9: no data for 4 s") in found
    assert (31, State.ERROR, "/dev/ttyS9: unplugged") in found
    assert "/dev/ttyS9: unplugged" in run.log


@settings(max_examples=40)
@given(st.binary(max_size=600))
def test_no_bytes_crash_it(data: bytes) -> None:
    simulate(GPS, stream=data + pvt())


def test_damage_costs_no_more_than_what_is_damaged() -> None:
    dice = random.Random(1)
    data = bytearray(DATA.read_bytes())
    for _ in range(100):
        data[dice.randrange(len(data))] = dice.randrange(256)
    run = simulate(GPS, stream=bytes(data))
    assert 15 <= len(fixes(run)) <= 40
    assert run.task.receiver.bad > 10
    assert len(run.log) <= 6


def test_a_height_that_comes_more_seldom_than_positions_counts_until_the_next() -> None:
    stream = []
    for step in range(150):
        second, tenth = divmod(step * 2, 10)
        at = f"12{second // 60:02d}{second % 60:02d}.{tenth}0"
        text = sentence(f"GPRMC,{at},A,4110.0,N,00842.0,W,2.0,90.0,010126,,,A")
        if not tenth:
            text += sentence(f"GPGGA,{at},4110.0,N,00842.0,W,1,08,0.9,100.0,M,50.0,M,,")
        stream.append((second + tenth / 10, text))
    found = fixes(simulate(GPS, stream=stream))
    assert len(found) > 140
    assert {fix.height for fix in found[1:]} == {150.0}
