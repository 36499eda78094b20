"""Recordings as labs leave them, made a campaign folder: columns guessed, roles proposed, compared with the rig."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...base.errors import InputError
from ...identify.columns.guess import ColumnGuess, guess_columns
from ...identify.columns.polarity import held_against, mended
from ...identify.columns.roles import RecordMotion, Roles, by_order, motion, roles
from ...records import ColumnMap, load_campaign, read_record
from ...records.campaign import FILE
from ...records.foreign import UNREAD, ConvertedTable
from ...records.read import UNUSED
from ...rigs.driven import driven
from ...rigs.rig import Rig
from ...rigs.rig_file import bundled, rig_text
from ..common.outcome import Outcome, Progress
from ..common.run_folder import RunFolder
from .page import import_page, metrics
from .tables import converted, set_apart, summaries
from .written import campaign_text

OWN = "rig.toml"
_TRIALS = 4  # mistakes that are undone one after the other


def run_import(files: Sequence[Path], rig: Rig, declared: str, run: RunFolder, progress: Progress) -> Outcome:
    """Convert, guess, propose roles, hold against the rig; the campaign folder is the run's own."""
    parts = converted(files, run.dir, progress)
    progress("columns")
    guesses = guess_columns(summaries(parts, run.dir), rig)
    named, extra = (declared, {}) if declared in bundled() else (OWN, {OWN: rig_text(rig)})
    for name, text in extra.items():
        (run.dir / name).write_text(text, encoding="utf-8")
    period = None if any(guess.signal == "t" for guess in guesses) else _period(parts)
    progress("compared with the rig")
    guesses, division, problem, mends = _tried(run.dir, parts, guesses, rig, named, period)
    text = campaign_text(named, division, guesses, period)
    numbers = metrics(guesses, division, parts, problem, mends)
    page = partial(import_page, guesses, division, parts, rig, problem, mends)
    return Outcome(numbers, page, files={**extra, FILE: text})


def _tried(
    folder: Path,
    parts: Sequence[ConvertedTable],
    guesses: list[ColumnGuess],
    rig: Rig,
    named: str,
    period: float | None,
) -> tuple[list[ColumnGuess], Roles, str, list[str]]:
    """Guesses and roles that the commands take, or those of the first trial and what stands in their way; what was
    mended in the records."""
    mends: list[str] = []
    division = by_order([part.file for part in parts])
    if period is None and all(guess.signal != "t" for guess in guesses):
        guesses = _set_apart(guesses, parts, folder)
        return guesses, division, _without_clock(parts, guesses), mends
    last = ""
    for _ in range(_TRIALS):
        guesses = _set_apart(guesses, parts, folder)
        try:
            division = roles(_motions(folder, parts, guesses, period))
            if not division.entries["heldout"]:
                return guesses, division, division.reason, mends
            (folder / FILE).write_text(campaign_text(named, division, guesses, period), encoding="utf-8")
            campaign = driven(load_campaign(folder), rig)
            notes = dict.fromkeys(note for record in campaign.records for note in record.notes)
            mends = [note for note in notes if UNUSED not in note]
            verdict = held_against(campaign, rig)
        except InputError as error:
            return guesses, division, str(error).replace(f"{folder}/", ""), mends
        if verdict.mistake is None:
            return guesses, division, verdict.problem.replace(f"{folder}/", "").replace(f"{folder}: ", ""), mends
        guesses, last = mended(guesses, verdict.mistake, rig), verdict.mistake.told(rig.name)
    return guesses, division, f"{_TRIALS} mistakes were undone, and the last was not tried again: {last}", mends


def _period(parts: Sequence[ConvertedTable]) -> float | None:
    """From row to row [s], where the files say so. Raises InputError where they say different ones."""
    said = {part.period: part.origin for part in parts}
    if len(said) > 1:
        both = " and ".join(f"{'none' if p is None else f'{p:g} s'} in {of}" for p, of in list(said.items())[:2])
        raise InputError(f"the period above the table is {both}; import the files one by one")
    return next(iter(said))


def _without_clock(parts: Sequence[ConvertedTable], guesses: Sequence[ColumnGuess]) -> str:
    """That nothing is a clock, with what comes nearest to one, and what to do."""
    near = [f'"{guess.column.cell}" {guess.reason}' for guess in guesses if guess.suggested == "t"]
    near += dict.fromkeys(note for part in parts for note in part.notes if note.startswith(UNREAD))
    told = f"no column is read as a clock{': ' if near else ''}{'; '.join(near)}"
    return f'{told}; export the time in seconds, or write t = {{period = "1 ms"}} under [signals], from row to row'


def _set_apart(guesses: list[ColumnGuess], parts: Sequence[ConvertedTable], folder: Path) -> list[ColumnGuess]:
    cells = set_apart(guesses, parts, folder)
    return [
        replace(guess, column=replace(guess.column, cell=cells.get(guess.column.cell, guess.column.cell)))
        for guess in guesses
    ]


def _motions(
    folder: Path, parts: Sequence[ConvertedTable], guesses: Sequence[ColumnGuess], period: float | None
) -> list[RecordMotion]:
    """How every record moves. Raises InputError for one that cannot be read as the guesses say."""
    mapping = {guess.signal: guess.mapping for guess in guesses if guess.signal is not None}
    if "t" not in mapping and period is not None:
        mapping["t"] = ColumnMap(period=period)
    return [motion(read_record(folder / part.file, mapping), part.file) for part in parts]
