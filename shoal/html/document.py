"""An HTML document with its style and script inside, whose policy allows nothing from elsewhere."""

import base64
import hashlib
from pathlib import Path

from shoal.html.elements import escape_text

_STYLE = Path(__file__).parent / "style.css"


def html_document(title: str, body: str, *, style: str = "", script: str = "", images: bool = False) -> str:
    """A document with the shared style and `style`; `title` is text, `body` HTML.

    Its content security policy allows this one script, and images only as `data:` and with `images`.
    """
    policy = ["default-src 'none'", "style-src 'unsafe-inline'", "base-uri 'none'"]
    if images:
        policy.append("img-src data:")
    if script:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        policy.append(f"script-src 'sha256-{digest}'")
        body += f"<script>{script}</script>"
    text = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{"; ".join(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape_text(title)}</title><style>{_STYLE.read_text(encoding="utf-8")}{style}</style></head>
<body>{body}</body></html>
"""
    return text.encode("utf-8", "replace").decode("utf-8")
