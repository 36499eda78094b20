"""What a commissioning leaves: commission.json, the controller as file, C and ST, and the rig as it was found."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...base.gain_phase import gain_db, phase_deg
from ...base.toml_text import toml_text
from ...control.automatic_tuning import SmallMoves
from ...control.controller_spec import ControllerSpec
from ...control.export.c_code import c_code
from ...control.export.link_program import link_program
from ...control.export.program import program_of
from ...link.commissioning.allowed import ExpectedStep
from ...link.commissioning.designs import experiment_of
from ...link.commissioning.obstacles import Obstacle
from ...link.commissioning.rig_time import RigTime
from ...link.commissioning.verify import STEPS, Way, best_way, hidden_step, limit_row, responses, table_row
from ...link.course import Judged
from ...loop.limit import settling_limit
from ...loop.scenarios import SCENARIOS
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.limits_told import limits_json
from ..common.outcome import Outcome
from ..common.run_folder import metrics_json
from ..record.study import recorded_figure
from .page import barred_page, commission_page
from .rounds import Found, sentence

_PAIR = ("predicted", "measured")


@dataclass(frozen=True)
class Results:
    """What came out: the goal, what small moves told, each way's controller and the plants that it was made for, how
    they did, what was found, what the goal would settle in [s] with exact numbers, what the rounds left open and why
    they ended, what is in the way, and what there was no time to compute."""

    goal: str
    moves: SmallMoves
    ways: Mapping[str, Way]
    judged: Sequence[Judged]
    found: Found | None
    exact: float | None
    reasons: Sequence[str]
    ended: str | None
    obstacles: Sequence[Obstacle]
    cut: Sequence[str]


def outcome(results: Results, spent: RigTime, folder: Path) -> Outcome:
    """The outcome of a commissioning that came to its end, with its `folder`."""
    found, judged, goal = results.found, results.judged, results.goal
    rig = found.rig if found else spent.rig
    stiff = {name: each.stiffness() for name, each in results.ways.items()}
    rows = [table_row(each, _expected(results.ways[each.controller], each), stiff[each.controller]) for each in judged]
    shown = [name for name in STEPS if hidden_step(rig, SCENARIOS[name]) is None]
    rows += [limit_row(name, settling_limit(rig, SCENARIOS[name]).settling) for name in shown]
    way = best_way(rows, goal, found is not None and found.explains)
    metrics = {
        "verdict": found.answer.verdict if found else "unknown",
        "effects": list(found.answer.effects) if found else [],
        "rows": rows,
        "bode": _bode(judged),
        "rig_seconds": spent.spent,
        **_limits(spent),
        "ended": next((each.row["tripped"] for each in judged if each.row["tripped"]), results.ended or spent.over),
        "played": spent.log,
        "controller": "controller.toml",
        "way": way,
        "rounds": list(results.reasons),
        "cut": list(results.cut),
        "exact_s": results.exact,
        "obstacles": [asdict(each) for each in results.obstacles],
        "small_moves": asdict(results.moves),
        "dither": spent.dither and {"amplitude": spent.dither.amplitude, "frequency_hz": spent.dither.frequency},
        "timing": {"computing_seconds": spent.computing.spent},
    }
    (folder / "c").mkdir(exist_ok=True)
    files = _files(results.ways[way].spec, rig, metrics)
    subject = Subject(rig, [each.spec for each in results.ways.values()])
    assert spent.last is not None
    last = recorded_figure(spent.last, spent.mark)
    said = sentence(found.answer) if found else results.ended or ""
    return Outcome(metrics, lambda: commission_page(spent.rig, goal, metrics, judged, said, last), {}, files, subject)


def _expected(way: Way, each: Judged) -> ExpectedStep:
    return way.plants.expected(way.spec, each.scenario)


def _bode(judged: Sequence[Judged]) -> list[dict[str, Any]]:
    """The found rig's controller, sine by sine; null where one was not played to its end."""
    f, *both = responses(judged, "found")
    gains, phases = (np.stack([of(each) for each in both], axis=1).tolist() for of in (gain_db, phase_deg))
    return [
        {
            "frequency_hz": hz,
            "gain_db": dict(zip(_PAIR, gain, strict=True)),
            "phase_deg": dict(zip(_PAIR, phase, strict=True)),
        }
        for hz, gain, phase in zip(f.tolist(), gains, phases, strict=True)
    ]


def _limits(spent: RigTime) -> dict[str, Any]:
    """How often something tripped, each time, the limits, and what they made smaller or left out."""
    return {
        "trips": len(spent.trips),
        "tripped": [trip.table() for trip in spent.trips],
        "limits": limits_json(spent.rig),
        "smaller": spent.smaller,
    }


def barred_outcome(spent: RigTime, obstacle: Obstacle) -> Outcome:
    """The outcome of one that ended before a controller was searched: what stands in the way."""
    metrics: dict[str, Any] = {
        "verdict": "unknown",
        "effects": [],
        "rows": [],
        "rig_seconds": spent.spent,
        **_limits(spent),
        "ended": obstacle.what,
        "played": spent.log,
        "controller": None,
        "way": None,
        "rounds": [],
        "cut": [],
        "exact_s": None,
        "obstacles": [asdict(obstacle)],
        "small_moves": None,
        "dither": None,
        "timing": {"computing_seconds": spent.computing.spent},
    }
    assert spent.last is not None
    files, last = {"commission.json": _text(metrics)}, recorded_figure(spent.last, spent.mark)
    return Outcome(metrics, partial(barred_page, spent.rig, metrics, last), {}, files, Subject(spent.rig))


def _files(spec: ControllerSpec, found: Rig, metrics: Mapping[str, Any]) -> dict[str, str]:
    program = program_of("found", spec.build(found.period.value), False, {})
    link = link_program([program], found.limit("command_rate"))
    return {
        "commission.json": _text(metrics),
        "controller.toml": toml_text(experiment_of(spec, "found.toml")),
        "found.toml": rig_text(found),
        **{f"c/{name}": text for name, text in {**c_code(program), **link}.items()},
    }


def _text(metrics: Mapping[str, Any]) -> str:
    whole = {**metrics, "computing_seconds": metrics["timing"]["computing_seconds"]}
    return metrics_json(whole)
