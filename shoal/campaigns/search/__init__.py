"""Search: which values break a scenario, or serve it best, and how little has to change for that."""

from shoal.campaigns.search.axes import Values, values_of
from shoal.campaigns.search.course import AS_IT_IS, PART, SMALLER, TRIAL, Course
from shoal.campaigns.search.finding import Findings, findings
from shoal.campaigns.search.goal import Goal
from shoal.campaigns.search.spec import Search, read_search
from shoal.campaigns.search.writing import write_options, write_scenario

__all__ = [
    "AS_IT_IS",
    "PART",
    "SMALLER",
    "TRIAL",
    "Course",
    "Findings",
    "Goal",
    "Search",
    "Values",
    "findings",
    "read_search",
    "values_of",
    "write_options",
    "write_scenario",
]
