"""A report as it is left: what was judged, when and how above the verdict, and below all what doing it again needs."""

from dataclasses import replace
from datetime import datetime

from ...report import Page
from .design_numbers import Subject
from .run_folder import versions

_LISTED = 12  # controllers or rigs that the head names


def whole_page(page: Page, subject: Subject | None, date: str = "", command: str = "") -> Page:
    """The page on a subject with its head and footer; `date` and `command` where it is left in a folder."""
    every = versions()
    head = {**(_subject_words(subject) if subject else {}), "date": date, "jackbench": every.pop("jackbench")}
    footer = {**page.footer, "versions": ", ".join(" ".join(item) for item in every.items())}
    return replace(
        page,
        head={**page.head, **{key: text for key, text in (head | {"command": command}).items() if text}},
        footer=footer,
    )


def finished_at() -> str:
    """Now, by the clock of this place, to the minute."""
    return datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %z")


def _subject_words(subject: Subject) -> dict[str, str]:
    rig = subject.rig
    title = f"{rig.name}, {rig.title}" if rig.title else rig.name
    controllers, rigs = (
        [spec.name for spec in subject.controllers],
        [name for name in subject.rigs if name != "nominal"],
    )
    return {"rig": title, "controllers": _listed(controllers), "and the rigs": _listed(rigs)}


def _listed(names: list[str]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names if more <= 0 else [*names[:_LISTED], f"{more} more"])
