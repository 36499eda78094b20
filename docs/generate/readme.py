"""Sections of README.md and CONTRIBUTING.md as parts that pages include: what they say is written once."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
_HELD = re.compile(r"^<!--.*?-->\n", re.MULTILINE)
_LINKS = {
    "experiments/README.md": "reference/experiments.md",
    "examples/README.md": "reference/tutorials.md",
    "experiments/": "../experiments/",
    "docs/": "",
}  # where links lead from the pages that include a part


def parts() -> dict[str, str]:
    """One part for each section of README.md, one for CONTRIBUTING.md, and the page of the experiments."""
    sections = _sections((ROOT / "README.md").read_text("utf-8"))
    contributing = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("\n")[2]
    experiments = _HELD.sub("", (ROOT / "experiments" / "README.md").read_text("utf-8"))
    return {
        **{f"part_{_slug(title)}.md": text for title, text in sections.items()},
        "part_contributing.md": contributing,
        "experiments.md": experiments,
    }


def _sections(text: str) -> dict[str, str]:
    """The text under each heading of the second level, and of what is above the first one."""
    first, *rest = re.split(r"^## ", _HELD.sub("", text), flags=re.MULTILINE)
    bodies = {"top": first.partition("\n")[2]}
    bodies |= {title: body for title, _, body in (part.partition("\n") for part in rest)}
    return {title: _led(body) for title, body in bodies.items()}


def _led(text: str) -> str:
    """Links and pictures as they lead from docs/."""

    def led(match: re.Match[str]) -> str:
        return "](" + next((to + match[1][len(at) :] for at, to in _LINKS.items() if match[1].startswith(at)), match[1])

    return re.sub(r"\]\(([^)\s]+)", led, text)


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")
