"""The page of a campaign."""

from shoal.campaigns.report.html_page import campaign_html

__all__ = [
    "campaign_html",
]
