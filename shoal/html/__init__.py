"""HTML pages that need no other file and no network: document, sections, tables, escaped text."""

from shoal.html.document import html_document
from shoal.html.elements import (
    cut_text,
    escape_text,
    html_section,
    html_table,
    html_tiles,
    short_number,
)

__all__ = ["cut_text", "escape_text", "html_document", "html_section", "html_table", "html_tiles", "short_number"]
