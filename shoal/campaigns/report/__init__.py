"""The page of a campaign."""

from shoal.campaigns.report.page import campaign_page

__all__ = [
    "campaign_page",
]
