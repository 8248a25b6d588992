"""Study files, and all that they name by content."""

from shoal.campaigns.studies.bundle import parse_bundle
from shoal.campaigns.studies.bundle_workspace import (
    UNNAMED_FILE_HINT,
    OriginalPathsExecutor,
    Workspace,
    WorkspaceRunner,
)
from shoal.campaigns.studies.study import LOGS, Study, load_study

__all__ = [
    "LOGS",
    "UNNAMED_FILE_HINT",
    "OriginalPathsExecutor",
    "Study",
    "Workspace",
    "WorkspaceRunner",
    "load_study",
    "parse_bundle",
]
