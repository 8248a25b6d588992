"""Builds the documentation as a web site: these pages, README, and a reference of the public modules.

`python docs/build_site.py FOLDER` (needs `pip install '.[docs]'`). A link without its page or heading ends it with an
error. The navigation is that of docs/README.md.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PROJECT = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#:]+)(#[^)]*)?\)")
FILE = re.compile(r"^(```\w+) file=(\S+)", re.MULTILINE)
MODULES = re.findall(r"^[a-z.]+$", (DOCS / "public_interface.txt").read_text(), re.MULTILINE)
OWN_NAMES = {"imc": "members: {}"}  # the messages are listed by `shoal message`
SETTINGS = """\
[project]
site_name = "Shoal"
site_description = "A deterministic task runtime for unmanned vehicles, in the family of DUNE/IMC"
docs_dir = "pages"
site_dir = "site"
use_directory_urls = false
nav = [
{nav}
]
[project.theme]
font = false
features = ["content.code.copy", "navigation.footer", "navigation.tabs", "navigation.top", "search.highlight"]
[project.markdown_extensions]
tables = {{}}
toc.permalink = true
pymdownx.highlight = {{}}
pymdownx.superfences = {{}}
[project.plugins.mkdocstrings.handlers.python]
paths = ["{root}"]
[project.plugins.mkdocstrings.handlers.python.options]
show_source = false
show_root_heading = true
show_root_full_path = true
members_order = "alphabetical"
"""


def main(folder: Path) -> int:
    """Build the site in `folder`; the exit status is that of zensical, 1 for a broken link."""
    with tempfile.TemporaryDirectory(prefix="shoal-site-") as name:
        work = Path(name)
        pages = write_pages(work / "pages")
        nav = "\n".join(f"  {{ {quote(title)} = [{', '.join(entries)}] }}," for title, entries in pages.items())
        (work / "zensical.toml").write_text(SETTINGS.format(nav=nav, root=ROOT.as_posix()))
        status = subprocess.run(
            [sys.executable, "-m", "zensical", "build", "--strict"], cwd=work, check=False
        ).returncode
        if status == 0:
            folder.parent.mkdir(parents=True, exist_ok=True)
            (work / "site").rename(folder)
    return status


def write_pages(folder: Path) -> dict[str, list[str]]:
    """Write all pages; returns the tabs of the navigation, each with its entries (strings of TOML)."""
    names = {path: path.relative_to(DOCS) for path in DOCS.rglob("*") if path.suffix in (".md", ".png", ".svg", ".txt")}
    names |= {ROOT / name: Path(page) for name, page in PROJECT.items()}
    names[DOCS / "README.md"] = Path("all.md")
    for path, name in names.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(redirect(path, names).encode() if path.suffix == ".md" else path.read_bytes())
    tabs = {"Shoal": ['"index.md"', '"all.md"'], **tabs_by_role(names)}
    (folder / "reference").mkdir()
    for module in MODULES:
        options = f"\n    options:\n      {OWN_NAMES[module]}\n" if module in OWN_NAMES else "\n"
        (folder / "reference" / f"{module}.md").write_text(f"# {module}\n\n::: {module}{options}")
    tabs["Modules"] = [f"{{ {quote(module)} = {quote(f'reference/{module}.md')} }}" for module in MODULES]
    decisions = sorted(str(name) for path, name in names.items() if path.parent == DOCS / "decisions")
    return tabs | {"Project": ['"changelog.md"', '"contributing.md"', *map(quote, decisions)]}


def tabs_by_role(names: dict[Path, Path]) -> dict[str, list[str]]:
    """A tab for each heading of docs/README.md, with the pages that its section links to."""
    tabs = dict[str, list[str]]()
    for section in (DOCS / "README.md").read_text().split("\n## ")[1:]:
        title, _, text = section.partition("\n")
        tabs[title] = [quote(link[2]) for link in LINK.findall(text)]
    missing = {path.name for path in DOCS.glob("*.md")} - {"README.md"}
    missing -= {entry.strip('"') for entries in tabs.values() for entry in entries}
    if missing:
        raise SystemExit(f"docs/README.md links to no {', '.join(sorted(missing))}")
    return tabs


def redirect(path: Path, names: dict[Path, Path]) -> str:
    """The text of a page as the site has it: links to source files become plain text, names of files titles."""
    here = names[path].parent

    def change(link: re.Match[str]) -> str:
        picture, words, target, anchor = link[1], link[2], (path.parent / link[3]).resolve(), link[4] or ""
        if target == DOCS / "decisions":
            return words
        if target not in names:
            return words if target.exists() else link[0]
        return f"{picture}[{words}]({Path('.' if here == Path() else '..') / names[target]}{anchor})"

    return FILE.sub(r'\1 title="\2"', LINK.sub(change, path.read_text()))


def quote(text: object) -> str:
    """A string of TOML."""
    return f'"{text}"'


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
