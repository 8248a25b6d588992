"""What varies: distributions, and the value that each run draws."""

from shoal.campaigns.draws.design import SAMPLINGS, WHOLE, Design, seed_of, share
from shoal.campaigns.draws.distributions import Distribution, Scalar, StudyFileError, parse_scalar, read_distribution
from shoal.campaigns.draws.template import Changeable, Make, blamed, load_template

__all__ = [
    "SAMPLINGS",
    "WHOLE",
    "Changeable",
    "Design",
    "Distribution",
    "Make",
    "Scalar",
    "StudyFileError",
    "blamed",
    "load_template",
    "parse_scalar",
    "read_distribution",
    "seed_of",
    "share",
]
