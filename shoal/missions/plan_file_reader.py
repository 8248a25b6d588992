"""Reads plans from files."""

from pathlib import Path

import imc
from autonomy.plans.yaml import PlanFileError, parse_plan
from support.located_yaml import read_text


def load_plan(path: Path) -> imc.PlanSpecification:
    """The plan in a YAML or JSON file. Raises PlanFileError, and OSError if it cannot be read."""
    return parse_plan(read_text(path, PlanFileError), str(path), json=path.suffix.lower() == ".json")
