"""The report of a plan: which record splits which pair and shows which number, and what is to be played."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.fit.free_parameters import Candidate
from ...identify.plan.family import SECONDS, PlannedRecord
from ...identify.trace.problem import EstimationProblem
from ...identify.trace.record_gain import ALIKE
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...report.figures import Mark
from ..common.time_figure import signal_panel

_LEG = re.compile(r"leg\d\.")
_LISTED = 3  # numbers that the verdict names of a record
_ON_A_RIG = "Each record is simulated on the rig as fitted, under the slow position loop of its drive. "
HOW = (
    "The cosine compares what two effects do to the errors of this record and of the campaign's, without the part that "
    "initial states and numbers can do as well. Played: the record is simulated with the first effect on; the shares "
    "say how much of the misfit each of the two explains. Of the records that separate a pair furthest, the first is "
    "given that does so as played."
)
_PLAY = (
    "A drive plays the .csv files beside this page: the reference, and the command, which is added to that of its "
    "position loop. Rehearse them with jackbench record RIG --play FILE.csv, add what the rig records to "
    "campaign.toml under train, and trace again."
)


@dataclass(frozen=True)
class Setting:
    """What a plan is about: a campaign on a rig, a `word` for what is planned, how it was simulated and how it is
    played, what a row of metrics.json's records plays and the head of its peak, figures of what is planned and of what
    was recorded; what the verdict says before, and sections that stand first."""

    campaign: str
    rig: str
    word: str
    how: str
    play: str
    wave: Callable[[Mapping[str, Any]], str]
    peak: str
    planned: Figure
    recorded: Callable[[], Figure]
    said: str = ""
    first: Sequence[Section] = ()


def plan_page(
    problem: EstimationProblem,
    candidates: Sequence[Candidate],
    metrics: Mapping[str, Any],
    records: Mapping[str, PlannedRecord],
) -> tuple[Page, Figure]:
    """The page of one jack, and its telling figure."""
    setting = Setting(
        problem.campaign.path.resolve().name,
        problem.rig.name,
        "record",
        _ON_A_RIG,
        _PLAY,
        lambda row: f"{row['kind']} on {SIGNALS[row['signal']].label}",
        "peak",
        _waves([records[row["record"]] for row in metrics["records"]]),
        lambda: _recorded(problem),
    )
    return page_of(setting, {candidate.effect.name: candidate for candidate in candidates}, metrics)


def page_of(setting: Setting, candidates: Mapping[str, Candidate], metrics: Mapping[str, Any]) -> tuple[Page, Figure]:
    """The page, and its telling figure: the cosines, what is to be played where no effects look alike, or what was
    recorded where nothing needs recording. `candidates` by the names that the pairs have."""
    pairs, planned = metrics["pairs"], [_records_table(setting, metrics), setting.play, setting.planned]
    sections = [*setting.first, *([Section("What to record next", planned)] if metrics["records"] else [])]
    if pairs:
        strengths = _strengths_table({name: each for name, each in candidates.items() if name in _names(pairs)})
        tables = [_pairs_table(setting, metrics), setting.how + HOW, _every_table(setting, metrics, "pairs"), strengths]
        sections.append(Section("Effects that look alike", [_cosines(pairs), *tables]))
    if metrics["numbers"]:
        tables = [_numbers_table(setting, metrics), _every_table(setting, metrics, "numbers")]
        sections.append(Section("Numbers that are not told", tables))
    if metrics["not_compared"]:
        names = ", ".join(metrics["not_compared"])
        said = f"Not compared, for want of a simulation at that strength on the rig as fitted: {names}."
        sections.append(Section("What was not compared", [said]))
    picture = _cosines(pairs) if pairs else setting.planned if metrics["records"] else setting.recorded()
    title = f"What to record next on {setting.rig}, after {setting.campaign}"
    return Page(title, setting.said + _verdict(setting.campaign, metrics, setting.word), sections), picture


def _verdict(name: str, metrics: Mapping[str, Any], word: str = "record") -> str:
    alike, unseen = metrics["pairs"], metrics["numbers"]
    said = f"{name} leaves {_count(len(alike), 'pair')} of effects alike (cosine {ALIKE:g} or more) and "
    said += f"{_count(len(unseen), 'number')} untold."
    if not metrics["records"]:
        if alike or unseen:
            return f"{said} No {word} of the family changes that."
        return f"{said} {'Nothing that was compared' if metrics['not_compared'] else 'Nothing'} needs recording."
    first, *others = metrics["records"]
    return (
        said
        + f" Record next: {_gives(first, metrics)}"
        + "".join(f"; {_gives(row, metrics)}" for row in others[:2])
        + "."
        + _not_split(alike, word)
    )


def _not_split(pairs: Sequence[Mapping[str, Any]], word: str) -> str:
    """Which pairs nothing of the family tells apart."""
    left = [pair for pair in pairs if pair["best"] is None]
    if not left:
        return ""
    a, b = left[0]["effects"]
    now = left[0]["cosine"]
    least = min(left[0]["after"].values(), default=now)
    more = f", nor {_count(len(left) - 1, 'pair')} more" if len(left) > 1 else ""
    return f" No {word} of the family tells {a} from {b} (cosine {now:.2f}, at best {least:.2f} then){more}."


def _gives(row: Mapping[str, Any], metrics: Mapping[str, Any]) -> str:
    """A record with the pair that it splits furthest, or the numbers that it shows."""
    pairs = [pair for pair in metrics["pairs"] if pair["best"] == row["record"]]
    if pairs:
        pair = min(pairs, key=lambda pair: pair["after"][row["record"]] - pair["cosine"])
        a, b = pair["effects"]
        after = pair["after"][row["record"]]
        more = f" and {_count(len(pairs) - 1, 'pair')} more" if len(pairs) > 1 else ""
        return f"{row['file']}, which tells {a} from {b} (cosine {pair['cosine']:.2f}, then {after:.2f}){more}"
    names = row["tells"]
    more = f" and {_count(len(names) - _LISTED, 'number')} more" if len(names) > _LISTED else ""
    return f"{row['file']}, which tells {', '.join(names[:_LISTED])}{more}"


def _count(number: int, what: str) -> str:
    return f"{number or 'no'} {what}{'' if number == 1 else 's'}"


def _records_table(setting: Setting, metrics: Mapping[str, Any]) -> Table:
    rows = [
        [
            row["file"],
            setting.wave(row),
            row["peak"],
            row["seconds"],
            row["information"],
            ", ".join(map(_label, row["splits"])),
            ", ".join(row["tells"]),
        ]
        for row in metrics["records"]
    ]
    note = "Best first: by information on all pairs and numbers together."
    head = [
        "file",
        "wave",
        setting.peak,
        "duration [s]",
        "information [nat]",
        "best for the pairs",
        "best for the numbers",
    ]
    return Table(f"{setting.word.capitalize()}s, best first", head, rows, note=note)


def _pairs_table(setting: Setting, metrics: Mapping[str, Any]) -> Table:
    rows = []
    for pair in metrics["pairs"]:
        best, played = pair["best"], pair["played"]
        shares = [f"{100 * played[name]:.0f} %" for name in pair["effects"]] if played else ["", ""]
        cosines = pair["cosine"], pair["after"][best] if best else None, played and played["cosine"]
        now, *later = (None if value is None else round(value, 3) for value in cosines)
        rows.append([*pair["effects"], now, best or "none", *later, *shares])
    head = ["effect", "other", "cosine now", setting.word, "cosine after", "as played"]
    head += ["effect explains", "other explains"]
    return Table(f"Pair, {setting.word}, cosine", head, rows)


def _numbers_table(setting: Setting, metrics: Mapping[str, Any]) -> Table:
    rows = []
    for row in metrics["numbers"]:
        after = 100 * row["after"][row["best"]] if row["best"] else None
        rows.append([row["number"], 100 * row["share"], row["best"] or "none", after])
    note = (
        "95 % interval over the declared range; what the family cannot show needs another sensor or a narrower range."
    )
    head = ["number", "interval now [%]", setting.word, "after [%]"]
    return Table(f"Number, {setting.word}, interval", head, rows, note=note)


def _every_table(setting: Setting, metrics: Mapping[str, Any], what: str) -> Table:
    """What every record of the family would leave."""
    names = list(dict.fromkeys(name for row in metrics[what] for name in row["after"]))
    labels = [_label(row["effects"]) if what == "pairs" else row["number"] for row in metrics[what]]
    rows = [
        [label, *(None if name not in row["after"] else round(row["after"][name], 3) for name in names)]
        for label, row in zip(labels, metrics[what], strict=True)
    ]
    title = f"{'Cosine' if what == 'pairs' else 'Interval over range'} after each {setting.word}"
    return Table(title, ["", *names], rows)


def _label(effects: Sequence[str]) -> str:
    """ "drive.lag / drive.delay"; of a leg's two effects the leg once."""
    first, second = effects
    leg = _LEG.match(first)
    return f"{first} / {second.removeprefix(leg[0]) if leg else second}"


def _names(pairs: Sequence[Mapping[str, Any]]) -> set[str]:
    return {name for pair in pairs for name in pair["effects"]}


def _strengths_table(candidates: Mapping[str, Candidate]) -> Table:
    """At which strength effects are compared."""
    rows = []
    for name, candidate in candidates.items():
        for number in candidate.effect.numbers:
            value = float(from_si(candidate.start[number.name], number.shown, number.si))
            rows.append([name, candidate.effect.formula, number.name, value, number.shown])
    note = "As the misfit has it where the effect explains a part of that, else typical."
    return Table("Effects as they are compared", ["effect", "formula", "number", "value", "unit"], rows, note=note)


def _cosines(pairs: Sequence[Mapping[str, Any]]) -> Figure:
    """Cosine of every pair now, after its best record, and as played."""
    places = np.arange(1.0, len(pairs) + 1)
    values = {
        "now": [pair["cosine"] for pair in pairs],
        "after its record, expected": [pair["after"][pair["best"]] if pair["best"] else np.nan for pair in pairs],
        "as played with the first effect on": [
            pair["played"]["cosine"] if pair["played"] else np.nan for pair in pairs
        ],
    }
    curves = [Curve(name, places, np.array(cosine), "markers") for name, cosine in values.items()]
    marks = (Mark(ALIKE, "alike"),)
    panel = Panel("cosine [1]", curves, y_range=(-0.05, 1.05), marks=marks)
    names = [_label(pair["effects"]) for pair in pairs]
    return Figure("How alike effects look, now and after the next record", "pair", [panel], x_names=names)


def _waves(records: list[PlannedRecord]) -> Figure:
    """What a drive plays."""
    panels = []
    for name in ("command", "reference"):
        own = {each.name: each.played for each in records if each.design.signal == name}
        courses = {label: (played.t, np.asarray(getattr(played, name))) for label, played in own.items()}
        marks = (Mark(0.0),) if name == "command" else ()
        panels += [signal_panel(SIGNALS[name], courses, marks=marks)] if courses else []
    return Figure(f"What to play, {SECONDS:g} s each", "time [s]", panels)


def _recorded(problem: EstimationProblem) -> Figure:
    """The command of the train records."""
    courses = {record.name: (record.t, record.signals["command"]) for record in problem.campaign.train}
    return Figure("What was recorded", "time [s]", [signal_panel(SIGNALS["command"], courses)])
