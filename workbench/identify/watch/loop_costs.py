"""What a rig's changes do to a tuned loop: margins, step, sine and worst plant on the rig as each session found it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from inspect import getfile
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.private_cache import kept
from ...control.controller_spec import ControllerSpec
from ...control.load_class import load_class
from ...loop.rig_variations import Conditions, with_delay
from ...loop.rows import LoopSetup, judge, linear_loops, loop_setup, play
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...plant.effects import known_effects
from ...plant.effects.declared import effect_use
from ...rigs.rig import Rig
from .history import History
from .known_then import NORMAL, intervals
from .told import NamedChange, numbers_then

FIGURES = (
    "gain_margin_db",
    "phase_margin_deg",
    "ms",
    "settling_s",
    "overshoot_percent",
    "sine_error",
    "worst_gain_margin_db",
)
MARGINS = FIGURES[:3]
SINE = Scenario("position-sine-5hz", "position", 2e-3, 1.0, frequency=5)
_DIGITS = 6  # of a rig's numbers
_FORM = 2  # of what the cache keeps
_PLACES = (-0.8, 0.0, 0.8)  # of the stroke, at which a worse plant than the session's own at its middle is sought


@dataclass(frozen=True)
class TunedLoop:
    """A controller on rigs that change: the `scenario` that it is judged in, the `conditions` it is judged under."""

    controller: ControllerSpec
    scenario: Scenario
    conditions: Conditions


def loop_figures(
    loop: TunedLoop, rig: Rig, known: History, moves: np.ndarray, deviations: np.ndarray, told: Sequence[NamedChange]
) -> dict[str, list[float | None]]:
    """Margins, the scenario's step, the error of a sine and the worst plant, on the rig of every session [T].

    The rig has the numbers that the session tells, moves [T, n] and their deviations [T, n]; while a change is there,
    those of the fits with what is named, and while one without a name is there, there are no figures. A rig is judged
    once: its figures stay in the user's cache.
    """
    rows: list[dict[str, float | None]] = []
    for t, value in enumerate(intervals(rig, known, moves, deviations)[0]):
        if any(each.is_unknown(t) for each in told):
            rows.append({})
            continue
        seen = [k for k in range(known.numbers) if np.isfinite(value[k])]
        values = {known.axes[k].name: float(value[k]) for k in seen}
        own = values | numbers_then(told, float(known.days[t]), known.days)
        half = {known.axes[k].name: NORMAL * known.axes[k].scale * float(deviations[t, k]) for k in seen}
        rows.append(_kept_row(loop, rig, _rounded(own), _rounded(half)))
    return {name: [row.get(name) for row in rows] for name in FIGURES}


def _kept_row(
    loop: TunedLoop, rig: Rig, values: Mapping[str, float], half: Mapping[str, float]
) -> dict[str, float | None]:
    own = rig_with(rig, values)

    def judged() -> dict[str, float | None]:
        row = loop_row(loop, own)
        worst = {"worst_gain_margin_db": _worst(loop, rig, values, half, row.get("gain_margin_db"))}
        return {name: value for name, value in (row | worst).items() if name in FIGURES}

    key = {"loop": asdict(loop), "laws": laws(loop.controller), "form": _FORM}
    return kept("loop", key | {"rig": own.table(), "half": half}, judged)


def laws(spec: ControllerSpec) -> list[str]:
    """What says that a controller is the same one: its name, and the code of its law and of its compensators."""
    classes = [load_class(each.use, each.name) for each in (spec, *spec.compensators)]
    return [spec.name, *(sha256(Path(getfile(each)).read_bytes()).hexdigest() for each in classes)]


def _rounded(values: Mapping[str, float]) -> dict[str, float]:
    """So that the last bits of a sum over sessions do not make another rig."""
    return {name: float(f"{value:.{_DIGITS}g}") for name, value in values.items()}


def rig_with(rig: Rig, values: Mapping[str, float]) -> Rig:
    """The rig with numbers [SI] of a session, and with the effect whose numbers `EFFECT.NUMBER` are among them."""
    numbers = {
        name: replace(number, value=max(values[name], 1e-6 * abs(number.value)), low=None, high=None, interval=None)
        for name, number in rig.numbers.items()
        if name in values
    }
    declared = {use.name for use in rig.effects}
    uses = []
    for effect in {e.name: e for e in reversed(known_effects())}.values():
        own = {n.name: values[effect.key(n.name)] for n in effect.numbers if effect.key(n.name) in values}
        if own and effect.name not in declared:
            uses.append(effect_use(effect, own, "the watch"))
    return replace(rig, numbers={**rig.numbers, **numbers}, effects=(*rig.effects, *uses))


def loop_row(loop: TunedLoop, rig: Rig) -> dict[str, Any]:
    """Margins, step and sine of the loop on a rig; nothing where the rig can not hold it."""
    controller, scenario = loop.controller, loop.scenario
    try:
        setup = _setup(loop, rig)
        row = judge(controller, scenario, setup, linear_loops(controller, setup))[1]
    except InputError:
        return {}
    return row | {"sine_error": _sine(controller, setup) if scenario.signal == SINE.signal else None}


def margins(loop: TunedLoop, rig: Rig, place: float = 0.0) -> dict[str, float | None]:
    """The margins alone, at a place of the stroke; nothing where the rig can not hold the loop."""
    try:
        setup = _setup(loop, rig).where(replace(loop.scenario, start=0.0, start_share=place))
        loops = linear_loops(loop.controller, setup)
    except InputError:
        return {}
    return {name: loops.worst(max if name == "ms" else min, name) for name in MARGINS}


def _setup(loop: TunedLoop, rig: Rig) -> LoopSetup:
    return loop_setup(with_delay(rig, loop.conditions.delay(loop.controller, rig)))


def _sine(controller: ControllerSpec, setup: LoopSetup) -> float | None:
    run = play(controller, SINE, setup)
    return None if run.tripped is not None else sine_error(run, SINE)


def sine_error(run: LoopRun, scenario: Scenario) -> float:
    """RMS of the error over the later half, as a share of the reference's."""
    half = len(run.record.t) // 2
    reference, y = (run.record.signals[name][half:] for name in ("reference", scenario.signal))
    return float(np.std(reference - y) / np.std(reference))


def _worst(
    loop: TunedLoop, rig: Rig, values: Mapping[str, float], half: Mapping[str, float], own: float | None
) -> float | None:
    """The least gain margin over the stroke, of plants at ends of the intervals of a session's numbers, and its `own`
    one; None where one has none."""
    signs = np.random.default_rng(0).choice((-1.0, 1.0), (len(_PLACES), len(half)))
    plants: Sequence[Mapping[str, float]] = [
        {**values, **{name: values[name] + sign * half[name] for name, sign in zip(half, row, strict=True)}}
        for row in signs
    ]
    least = [margins(loop, rig_with(rig, plant), place) for plant, place in zip(plants, _PLACES, strict=True)]
    found = [own, *(each.get("gain_margin_db") for each in least)]
    return None if None in found else min(each for each in found if each is not None)
