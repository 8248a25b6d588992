"""The folder of a campaign: a journal of its rows, and the table made of it."""

from shoal.campaigns.results.store import (
    JOURNAL,
    LOGS,
    TABLE,
    CampaignResults,
    ResultsError,
    ResultsWriter,
    explain_mismatch,
    has_results,
    open_results,
    study_metadata,
)

__all__ = [
    "JOURNAL",
    "LOGS",
    "TABLE",
    "CampaignResults",
    "ResultsError",
    "ResultsWriter",
    "explain_mismatch",
    "has_results",
    "open_results",
    "study_metadata",
]
