"""What passes between computers is JSON, and is the same on both; addresses of clusters."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from shoal.campaigns import Job, UnfinishedResult, UnreadableResult, to_dask_address
from shoal.campaigns.cluster.float_fingerprint import compute_float_fingerprint
from shoal.campaigns.cluster.protocol import encode_line, job_from_line, job_to_line, result_from_line, result_to_line
from shoal.campaigns.jobs.cpu_timing import TimedResult
from shoal.scenarios import ExpectationVerdict, ScenarioResult

WHOLE = TimedResult(
    "dive",
    7,
    (ExpectationVerdict("deep", False, -0.1, "by 0.1", time=3.0, origin="a:3"), ExpectationVerdict("ends", True)),
    {"drift": 0.1 + 0.2, "never": math.nan, "small": 5e-324},
    {"lauv": "SUCCESS"},
    12.5,
    "Bad \udcff text",
    ("w",),
    {"lauv": Path("/there/lauv/day/time")},
    {"lauv": "00"},
    "ff",
    {"lauv": [41.1, -8.7, 0.0]},
    cpu=0.25,
)


def there_and_back(result, log_root=Path("/here")):
    line = encode_line(result_to_line(result, Path("/there")))
    assert line.count(b"\n") == 1
    return result_from_line(json.loads(line), log_root)


def test_a_result_arrives_to_the_last_bit():
    back = there_and_back(WHOLE)
    assert back.logs == {"lauv": Path("/here/lauv/day/time")}
    assert repr(vars(back) | {"logs": {}}) == repr(vars(WHOLE) | {"logs": {}})
    assert there_and_back(WHOLE, None).logs == {}


@pytest.mark.parametrize("kind", [ScenarioResult, UnfinishedResult, UnreadableResult])
def test_a_result_arrives_as_what_it_is(kind):
    assert type(there_and_back(kind("a", 0, error="b"))) is kind


def test_a_job_arrives_with_plain_values():
    job = Job(3, Path("a.yaml"), {"a/b": np.float64(0.1), "n": np.int64(4), "t": "x", "l": [1, True]}, 5, Path("/logs"))
    line = json.loads(encode_line(job_to_line(job)))
    back = job_from_line({**line, "log_root": "/elsewhere"})
    assert back == Job(3, Path("a.yaml"), {"a/b": 0.1, "n": 4, "t": "x", "l": [1, True]}, 5, Path("/elsewhere"))
    assert job_from_line(json.loads(encode_line(job_to_line(Job("x", Path("a")))))).log_root is None


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("dask://scheduler:8786", "tcp://scheduler:8786"),
        ("dask://10.0.0.1", "tcp://10.0.0.1:8786"),
        ("dask+tls://a.b:1", "tls://a.b:1"),
        ("dask://[::1]:9", "tcp://[::1]:9"),
    ],
)
def test_addresses_are_those_of_dask(text, address):
    assert to_dask_address(text) == address


@pytest.mark.parametrize(
    "text", ["", "tcp://a:1", "dask://", "dask://:1", "dask:a", "dask://a:b", "dask://a:1/b", "dask://u@a"]
)
def test_what_is_no_address_is_refused(text):
    with pytest.raises(ValueError, match="is not a cluster address such as dask://scheduler:8786"):
        to_dask_address(text)


def test_a_computer_computes_as_itself():
    assert compute_float_fingerprint() == compute_float_fingerprint()
    assert len(compute_float_fingerprint()) == 64
