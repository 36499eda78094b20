"""What a rig's changes do to a tuned loop: its margins and its step on the rig as each session found it."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ...identify.watch.changes import History
from ...loop.rig_variations import with_delay
from ...loop.rows import judge, linear_loops, loop_setup
from ...plant.effects import known_effects
from ...rigs.rig import Rig
from ..common.fit_result import effect_use
from ..common.step_experiment import StepConfig
from .told import Told

FIGURES = ("gain_margin_db", "phase_margin_deg", "ms", "settling_s", "overshoot_percent")


def loop_figures(
    loop: StepConfig, rig: Rig, known: History, moves: np.ndarray, told: Told | None
) -> dict[str, list[float | None]]:
    """Margins and the first scenario's step of the first controller, on the rig of every session [T].

    The rig has the numbers of the session; since a change began, those of the fit with what is named.
    """
    fitted: Mapping[int, Mapping[str, float]] = {} if told is None else told.numbers
    rows = []
    for t, move in enumerate(moves):
        values = {a.name: a.at(float(move[k])) for k, a in enumerate(known.axes[: known.numbers])}
        rows.append(loop_row(loop, rig_with(rig, fitted.get(t, values))))
    return {name: [row.get(name) for row in rows] for name in FIGURES}


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


def loop_row(loop: StepConfig, rig: Rig) -> dict[str, float | None]:
    """Margins and step of the loop on a rig; nothing where the rig can not hold it."""
    controller, scenario = loop.controllers[0], loop.scenarios[0]
    try:
        setup = loop_setup(with_delay(rig, loop.conditions.delay(controller, rig)))
        loops = linear_loops(controller, setup)
        return judge(controller, scenario, setup, loops)[1]
    except InputError:
        return {}
