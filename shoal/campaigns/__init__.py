"""Campaigns: many runs of scenarios, what varies in them, and what they show."""

from shoal.campaigns.again import Rerun, rerun
from shoal.campaigns.campaign import carry_out
from shoal.campaigns.cluster import cluster_address
from shoal.campaigns.commands import rerun_command, rest_command, strange_paths, test_command
from shoal.campaigns.comparison import Comparison, Pair, compare
from shoal.campaigns.dataset import DataSet, is_data_set, open_data_set
from shoal.campaigns.engines import open_engine
from shoal.campaigns.jobs import (
    SUFFIX,
    WALL_LIMIT,
    Do,
    Engine,
    Job,
    Pool,
    Runner,
    StudyRunner,
    Unfinished,
    Unreadable,
    is_finished,
    processors,
)
from shoal.campaigns.junit import junit_xml
from shoal.campaigns.keeping import findings_of, told
from shoal.campaigns.merging import Merged, merge
from shoal.campaigns.notebook import run
from shoal.campaigns.report import campaign_page
from shoal.campaigns.search import Findings
from shoal.campaigns.shards import WHOLE, Shard, parse_shard, shard_folder
from shoal.campaigns.studies import LOGS, Study, load_study
from shoal.campaigns.suite import Outcome, find_scenarios, log_again, run_jobs
from shoal.campaigns.telling import details_of, facts_of, failures_of, other_logs, warnings_of

__all__ = [
    "LOGS",
    "SUFFIX",
    "WALL_LIMIT",
    "WHOLE",
    "Comparison",
    "DataSet",
    "Do",
    "Engine",
    "Findings",
    "Job",
    "Merged",
    "Outcome",
    "Pair",
    "Pool",
    "Rerun",
    "Runner",
    "Shard",
    "Study",
    "StudyRunner",
    "Unfinished",
    "Unreadable",
    "campaign_page",
    "carry_out",
    "cluster_address",
    "compare",
    "details_of",
    "facts_of",
    "failures_of",
    "find_scenarios",
    "findings_of",
    "is_data_set",
    "is_finished",
    "junit_xml",
    "load_study",
    "log_again",
    "merge",
    "open_data_set",
    "open_engine",
    "other_logs",
    "parse_shard",
    "processors",
    "rerun",
    "rerun_command",
    "rest_command",
    "run",
    "run_jobs",
    "shard_folder",
    "strange_paths",
    "test_command",
    "told",
    "warnings_of",
]
