"""Checks the pages of the documentation site: every link and picture leads to a file and a place that are there, and
nothing is loaded from a network. Prints one line for each that does not; the argument is the folder of the site.
"""

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_LEADS = {"a": "href", "link": "href", "script": "src", "img": "src", "iframe": "src"}
_LOADED = ("script", "img", "iframe", "link")


class Page(HTMLParser):
    """The places of a page and what it leads to: (tag, address)."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.leads: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called for every tag of the page."""
        given = dict(attrs)
        self.places |= {name for name in (given.get("id"), given.get("name")) if name}
        if address := given.get(_LEADS.get(tag, "")):
            self.leads.append((tag, address))


def broken(folder: Path) -> Iterator[str]:
    """One line for each link of a site that leads nowhere, or that a browser would fetch from a network."""
    pages = {path: Page(path.read_text("utf-8")) for path in sorted(folder.rglob("*.html"))}
    for path, page in pages.items():
        for tag, address in page.leads:
            if problem := _problem(path, tag, address, pages):
                yield f"{path.relative_to(folder)}: {address}: {problem}"


def _problem(path: Path, tag: str, address: str, pages: dict[Path, Page]) -> str:
    parts = urlsplit(address)
    if parts.scheme == "data":
        return ""
    if parts.scheme or parts.netloc:
        return "is loaded from a network" if tag in _LOADED else ""
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not target.is_file():
        return "no such file"
    if parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].places:
        return "no such place on that page"
    return ""


def main(folder: str) -> int:
    """Check a site; 1 where a link is broken or there is no page."""
    lines = list(broken(Path(folder).resolve()))
    pages = len(list(Path(folder).rglob("*.html")))
    print("\n".join(lines) or f"{pages} pages, every link leads somewhere")
    return bool(lines) or not pages


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
