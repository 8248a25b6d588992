"""Prints findings with their severity and their fix."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from support.diagnostics import Finding, Severity
from support.terminal_text import printable

STYLES: Mapping[Severity, str] = MappingProxyType({"error": "red", "warning": "yellow", "note": "cyan"})


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    order = list(STYLES)
    return sorted(findings, key=lambda finding: order.index(finding.severity))


def print_findings(console: Console, findings: Iterable[Finding]) -> None:
    for finding in findings:
        about = f"{finding.about}: " if finding.about else ""
        label = f"{finding.severity}: ", STYLES[finding.severity]
        console.print(Text.assemble(label, printable(f"{about}{finding.text}")))
        for place in finding.places:
            console.print(Padding(Text(printable(place)), (0, 0, 0, 6), expand=False))
        for advice in filter(None, (finding.meaning, finding.remedy)):
            console.print(Padding(Text(printable(advice), style="dim"), (0, 0, 0, 4), expand=False))
