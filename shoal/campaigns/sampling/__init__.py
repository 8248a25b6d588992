"""Sampled values: distributions, and the value that each run draws."""

from shoal.campaigns.sampling.design import FIXED_SIZE_SAMPLINGS, SAMPLINGS, SamplingDesign, hashed_uniform, run_seed
from shoal.campaigns.sampling.distributions import (
    Distribution,
    Scalar,
    StudyFileError,
    parse_distribution,
    split_value_and_unit,
)
from shoal.campaigns.sampling.template import DraftFactory, EditableScenario, describe_value_error, load_template

__all__ = [
    "FIXED_SIZE_SAMPLINGS",
    "SAMPLINGS",
    "Distribution",
    "DraftFactory",
    "EditableScenario",
    "SamplingDesign",
    "Scalar",
    "StudyFileError",
    "describe_value_error",
    "hashed_uniform",
    "load_template",
    "parse_distribution",
    "run_seed",
    "split_value_and_unit",
]
