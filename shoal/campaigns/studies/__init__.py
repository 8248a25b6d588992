"""Study files, and all that they name by content."""

from shoal.campaigns.studies.bundle import read_bundle
from shoal.campaigns.studies.site import UNNAMED, Named, OnSite, Site
from shoal.campaigns.studies.study import LOGS, Study, load_study

__all__ = ["LOGS", "UNNAMED", "Named", "OnSite", "Site", "Study", "load_study", "read_bundle"]
