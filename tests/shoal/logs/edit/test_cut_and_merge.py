"""Cutting and merging logs."""

import errno
import gzip
import os
import re
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

import imc
from runtime.logs import summarize
from shoal.logs.edit import cut, merge
from shoal.logs.edit.merge_logs import MergeConflict
from shoal.logs.selection import PacketSelection, selection_from_names
from tests.log_messages import OPERATOR, OTHER, START, VEHICLE, at, labels
from tests.outside import largest_file

LOGS = Path(__file__).parents[3] / "data" / "logs"
INF = float("inf")


def packets_of(folder: Path) -> list[bytes]:
    return [packet for _, packet in imc.Log(folder).packets()]


def cut_by(folder: Path, out: Path, **choice: object) -> list[bytes]:
    log = imc.Log(folder)
    summary = summarize(log)
    cut(log, out, selection_from_names(summary, **choice), summary.owner)
    return packets_of(out)


def test_a_time_of_a_log_of_dune(tmp_path):
    source = imc.Log(LOGS / "dune-idle")
    begin = summarize(source).start
    found = cut_by(LOGS / "dune-idle", tmp_path / "out", start=begin + 1.0, end=begin + 2.0, types=["EulerAngles"])
    all_packets = packets_of(LOGS / "dune-idle")
    times = [m.timestamp for m in imc.Log(tmp_path / "out").messages(imc.EulerAngles)]
    assert times == [m.timestamp for m in source.messages(imc.EulerAngles) if 1.0 <= m.timestamp - begin < 2.0]
    assert set(found) <= set(all_packets)
    assert imc.Log(tmp_path / "out").counts()["EntityInfo"] == source.counts()["EntityInfo"]
    assert summarize(imc.Log(tmp_path / "out")).names.labels == summarize(source).names.labels


def test_cutting_everything_gives_the_same_bytes(tmp_path):
    assert cut_by(LOGS / "dune-mission-cut", tmp_path / "out") == packets_of(LOGS / "dune-mission-cut")


def test_definitions_and_profile_are_copied(make_log, tmp_path):
    folder = make_log([at(0)])
    (folder / "Config.ini").write_text("[General]\n")
    cut_by(folder, tmp_path / "out")
    for name in ("IMC.xml.gz", "Config.ini"):
        assert (tmp_path / "out" / name).read_bytes() == (folder / name).read_bytes()


def test_by_system_entity_and_type(make_log, tmp_path):
    messages = [
        *labels(Battery=7, GPS=8),
        at(1),
        at(1, src_ent=8),
        at(2, imc.Current),
        at(2, imc.Announce, src=OPERATOR, sys_name="ccu-1"),
        at(3, src=OPERATOR),
    ]
    folder = make_log(messages)
    assert len(cut_by(folder, tmp_path / "a", entities=["gps"])) == 4
    assert len(cut_by(folder, tmp_path / "b", systems=["ccu-1"])) == 4
    assert len(cut_by(folder, tmp_path / "c", types=["Voltage"], systems=["lauv-noptilus-1"])) == 5


def test_other_systems_have_the_time_at_which_they_were_heard(make_log, tmp_path):
    messages = [at(0), *(m for n in range(10) for m in (at(n), at(n - 5e6, imc.Current, src=OTHER)))]
    found = cut_by(make_log(messages), tmp_path / "out", start=START + 3.0, end=START + 5.0)
    assert [imc.header(packet).src for packet in found] == [VEHICLE, OTHER] * 2


def test_nothing_chosen_leaves_nothing(make_log, tmp_path):
    log = imc.Log(make_log([at(0)]))
    with pytest.raises(ValueError, match="nothing is written"):
        cut(log, tmp_path / "out", PacketSelection(types=frozenset({imc.Abort.ID})), VEHICLE)
    assert not (tmp_path / "out").exists()


def test_a_cut_that_is_killed_leaves_no_log_and_the_next_one_succeeds(make_log, tmp_path):
    folder, out = make_log([at(0), at(1)]), tmp_path / "out"
    code = "import os, sys; import imc; from pathlib import Path; from runtime.logs import create_log\n"
    code += "with create_log(Path(sys.argv[1])) as log: log.write(imc.encode(imc.Voltage())); log.flush(); os._exit(9)"
    assert subprocess.run([sys.executable, "-c", code, str(out)]).returncode == 9
    assert not out.exists()
    (part,) = tmp_path.glob("*.part")
    hours_ago = part.stat().st_mtime - 7200.0
    for path in (*part.iterdir(), part):
        os.utime(path, (hours_ago, hours_ago))
    assert cut_by(folder, out) == packets_of(folder)
    assert not list(tmp_path.glob("*.part"))


def test_a_full_disk_leaves_no_log_and_is_named_with_the_file(make_log, tmp_path):
    noise = Random(1)
    log = imc.Log(make_log([at(n, imc.DevDataBinary, value=noise.randbytes(10_000)) for n in range(10)]))
    before, out = set(tmp_path.iterdir()), tmp_path / "out"
    with largest_file(40_000), pytest.raises(OSError, match=re.escape(str(out / "Data.lsf.gz"))) as caught:
        cut(log, out, PacketSelection(), VEHICLE)
    assert caught.value.errno == errno.EFBIG
    assert set(tmp_path.iterdir()) == before


def test_an_existing_folder_is_left_alone(make_log, tmp_path):
    folder = make_log([at(0)])
    with pytest.raises(FileExistsError):
        cut(imc.Log(folder), folder, PacketSelection(), VEHICLE)
    assert len(packets_of(folder)) == 1


def test_merging_the_parts_gives_the_whole(make_log, tmp_path):
    folder = make_log([at(n / 100) for n in range(3000)])
    parts = [(20.0, INF), (0.0, 10.0), (10.0, 20.0)]
    for number, (begin, end) in enumerate(parts):
        cut(imc.Log(folder), tmp_path / f"part{number}", PacketSelection(START + begin, START + end), VEHICLE)
    merged = merge([imc.Log(tmp_path / f"part{number}") for number in range(3)], tmp_path / "whole")
    assert packets_of(tmp_path / "whole") == packets_of(folder)
    assert (merged.packets, merged.copies, merged.warnings) == (3000, 0, [])


def test_merging_is_stable_and_by_time(make_log, tmp_path):
    one = [at(0, value=1.0), at(2, value=2.0), at(2, value=3.0), at(float("nan"), value=4.0), at(9, value=5.0)]
    two = [at(2, value=6.0), at(1, value=7.0)]
    merge([imc.Log(make_log(one, "one")), imc.Log(make_log(two, "two"))], tmp_path / "out")
    assert [m.value for m in imc.Log(tmp_path / "out")] == [1.0, 7.0, 2.0, 3.0, 4.0, 6.0, 5.0]


def test_what_stands_in_several_logs_is_written_once(make_log, tmp_path):
    one, two = make_log([at(1), at(1), at(2)], "one"), make_log([at(1), at(2), at(3)], "two")
    logs = [imc.Log(one), imc.Log(two)]
    merged = merge(logs, tmp_path / "out")
    assert (merged.packets, merged.copies) == (4, 2)
    assert merge(logs, tmp_path / "all", keep_copies=True).packets == 6


def test_entities_with_two_labels_are_reported(make_log, tmp_path):
    logs = [imc.Log(make_log(labels(**{name: 7}), name)) for name in ("GPS", "DVL")]
    (warning,) = merge(logs, tmp_path / "out").warnings
    assert "entity 7 of lauv-noptilus-1 is 'GPS' in" in warning


def public_log(tmp_path: Path, kind: str) -> Path:
    public = imc.load(Path(imc.__file__).parent / "definitions" / "imc-5.4.31.yaml")
    (tmp_path / kind).mkdir()
    (tmp_path / kind / "IMC.xml.gz").write_bytes(gzip.compress(imc.dump(public)))
    (tmp_path / kind / "Data.lsf").write_bytes(public.encode(public[kind](timestamp=START)))
    return tmp_path / kind


def test_definitions_that_suit_both_are_taken(make_log, tmp_path):
    logs = [imc.Log(public_log(tmp_path, "Rpm")), imc.Log(make_log([at(1, imc.EstimatedMugState)]))]
    merge(logs, tmp_path / "out")
    assert imc.Log(tmp_path / "out").counts() == {"Rpm": 1, "EstimatedMugState": 1}
    assert (tmp_path / "out" / "IMC.xml.gz").read_bytes() == (tmp_path / "log" / "IMC.xml.gz").read_bytes()


def test_definitions_that_contradict_are_refused(make_log, tmp_path):
    logs = [imc.Log(public_log(tmp_path, "GpioStateGet")), imc.Log(make_log([at(1, imc.EstimatedMugState)]))]
    with pytest.raises(MergeConflict, match=r"message 2001 of .* is GpioStateGet in"):
        merge(logs, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_damage_is_left_out_and_reported(make_log, tmp_path):
    one = make_log([imc.encode(at(1)), b"garbage", imc.encode(at(2))], "one", compression="none")
    merged = merge([imc.Log(one), imc.Log(make_log([at(3)], "two"))], tmp_path / "out")
    assert merged.packets == 3
    assert [(path.parent.name, loss.length) for path, loss in merged.losses] == [("one", 7)]
