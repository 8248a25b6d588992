"""Campaigns: many runs of scenarios, what varies in them, and what they show."""

from shoal.campaigns.cluster import to_dask_address
from shoal.campaigns.comparison import CampaignComparison, RunPair, compare_campaigns
from shoal.campaigns.executor_factory import open_executor
from shoal.campaigns.findings_files import compute_findings, describe_run
from shoal.campaigns.jobs import (
    SCENARIO_SUFFIX,
    WALL_LIMIT,
    Job,
    JobExecutor,
    ProcessPool,
    RunJob,
    ScenarioRunner,
    StudyRunner,
    UnfinishedResult,
    UnreadableResult,
    is_finished,
    usable_cpus,
)
from shoal.campaigns.junit import junit_xml
from shoal.campaigns.merge import MergedResults, merge_results
from shoal.campaigns.notebook_runner import run
from shoal.campaigns.report import campaign_html
from shoal.campaigns.repro_commands import missing_paths, rerun_command, resume_command, scenario_test_command
from shoal.campaigns.rerun import RepeatedRun, repeat_run
from shoal.campaigns.results import CampaignResults, has_results, open_results
from shoal.campaigns.run_outcome_text import (
    failure_details,
    failure_lines,
    other_consecutive_logs,
    outcome_to_dict,
    warning_lines,
)
from shoal.campaigns.scenario_suite import ScenarioOutcome, find_scenario_files, rerun_with_logs, run_jobs, variants_of
from shoal.campaigns.search import SearchFindings
from shoal.campaigns.shards import WHOLE_CAMPAIGN, Shard, parse_shard, shard_folder
from shoal.campaigns.studies import LOGS, Study, load_study
from shoal.campaigns.study_execution import run_study

__all__ = [
    "LOGS",
    "SCENARIO_SUFFIX",
    "WALL_LIMIT",
    "WHOLE_CAMPAIGN",
    "CampaignComparison",
    "CampaignResults",
    "Job",
    "JobExecutor",
    "MergedResults",
    "ProcessPool",
    "RepeatedRun",
    "RunJob",
    "RunPair",
    "ScenarioOutcome",
    "ScenarioRunner",
    "SearchFindings",
    "Shard",
    "Study",
    "StudyRunner",
    "UnfinishedResult",
    "UnreadableResult",
    "campaign_html",
    "compare_campaigns",
    "compute_findings",
    "describe_run",
    "failure_details",
    "failure_lines",
    "find_scenario_files",
    "has_results",
    "is_finished",
    "junit_xml",
    "load_study",
    "merge_results",
    "missing_paths",
    "open_executor",
    "open_results",
    "other_consecutive_logs",
    "outcome_to_dict",
    "parse_shard",
    "repeat_run",
    "rerun_command",
    "rerun_with_logs",
    "resume_command",
    "run",
    "run_jobs",
    "run_study",
    "scenario_test_command",
    "shard_folder",
    "to_dask_address",
    "usable_cpus",
    "variants_of",
    "warning_lines",
]
