"""Search: which values break a scenario, or serve it best, and how little has to change for that."""

from shoal.campaigns.search.config import SearchConfig, parse_search
from shoal.campaigns.search.export import write_scenario, write_tuned_options
from shoal.campaigns.search.objective import SearchObjective
from shoal.campaigns.search.schedule import AS_IT_IS, PART, SMALLER, TRIAL, SearchSchedule
from shoal.campaigns.search.search_findings import SearchFindings, summarize_search
from shoal.campaigns.search.search_space import ValueChanges, changed_values

__all__ = [
    "AS_IT_IS",
    "PART",
    "SMALLER",
    "TRIAL",
    "SearchConfig",
    "SearchFindings",
    "SearchObjective",
    "SearchSchedule",
    "ValueChanges",
    "changed_values",
    "parse_search",
    "summarize_search",
    "write_scenario",
    "write_tuned_options",
]
