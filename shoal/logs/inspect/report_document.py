"""The page of one run or of two: header, parts that a script lets the reader point at and zoom, footer."""

from pathlib import Path

from shoal.html import escape_text, html_document

_HERE = Path(__file__).parent
_HELP = "Point at a curve to read all values; drag to zoom, double-click to zoom out. Times are since the start."


def report_document(title: str, about: str, content: str, footer: str, duration: float, start: float) -> str:
    """An HTML document. `content` is HTML, the other texts are escaped; duration in s, start in s since 1970 UTC."""
    body = f"""<main data-duration="{duration:.6f}" data-start="{start:.3f}">
<header><h1>{escape_text(title)}</h1><p>{escape_text(about)}</p></header>
{content}
<footer>{_HELP} {escape_text(footer)}</footer>
</main><div id="tip"></div><button id="reset" hidden>Show all</button>"""
    style, script = ((_HERE / f"report.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
    return html_document(title, body, style=style, script=script)
