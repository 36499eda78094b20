"""The model of a frequency-response sheet: stepped sines of its amplitude on the plant on which it was measured."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ...base.errors import InputError, nearest
from ...base.gain_phase import gain_db
from ...engine import Engine
from ...linear import equilibrium
from ...linear.frequency_response import stepped_sines
from ...plant import Plant, build, build_pilot_bench, build_valve_bench
from ...plant.effects import Effect, applies
from ...plant.effects.slots import inside_valve
from ...records.sheet_points import SheetPoints
from ...rigs.rig import EffectUse, Rig
from .element import Element

FAILED = 1e3  # dB and degrees: the deviation of a sine that cannot be simulated
_CYCLES, _JACK_CYCLES = (2, 20), (4, 60)  # a jack rings longer than a valve
_PILOT_SLOTS = {"motor_current"}
Build = Callable[[Rig], Plant]


@dataclass(frozen=True, eq=False)
class SheetRig:
    """What sheets are measured on: how it is built, where it rests (states by name, inputs `offset` [m]), and after how
    many cycles, at least and at most, a sine of it counts as settled."""

    rig: Rig
    build: Build
    rest: Mapping[str, float]
    offset: np.ndarray
    cycles: tuple[int, int]

    def has_room(self, effect: Effect) -> bool:
        """Whether an effect acts on what is here of the rig."""
        if self.build is build_pilot_bench:
            return bool(effect.laws) and set(effect.laws) <= _PILOT_SLOTS
        return applies(effect, self.rig) and (self.build is build or inside_valve(effect.laws))


def bench_of(rig: Rig, input: str, output: str) -> SheetRig:
    """What a sheet of this pair is measured on: a bench of the pilot or the valve, or the whole rig at mid stroke.

    Raises InputError for a pair that none of them has.
    """
    benches: Mapping[str, tuple[Build, ...]] = {"current": (build_pilot_bench,), "command": (build_valve_bench, build)}
    if input not in benches:
        raise InputError(f"a sheet of {input} to {output} cannot be traced; take a sheet of {' or '.join(benches)}")
    outputs = []
    for bench in benches[input]:
        plant = bench(rig)
        outputs += plant.outputs
        if output in plant.outputs:
            held = {"speed": 0.0} if bench is build else {"command": 0.0}
            rest = equilibrium(plant, p=plant.without_dry_friction(), **held)
            states = dict(zip([state.name for state in plant.states], rest.x.tolist(), strict=True))
            return SheetRig(rig, bench, states, rest.u, _JACK_CYCLES if bench is build else _CYCLES)
    raise InputError(f"rig {rig.name} gives no {output}; {nearest(output, outputs)}")


def rig_with(rig: Rig, effects: Sequence[Effect]) -> Rig:
    """The rig with further effects, at their typical numbers."""
    uses = tuple(EffectUse(effect.name, effect.formula, {}) for effect in effects)
    return replace(rig, effects=(*rig.effects, *uses))


class SheetModel:
    """A rig with effects on the bench of its sheets, compiled once, then run with parameters in lanes: those of the
    plant, then those of the `element` learned behind it, where there is one."""

    element: Element | None = None

    def __init__(self, bench: "SheetRig", effects: Sequence[Effect], output: str) -> None:
        self.effects, self._output = tuple(effects), output
        self.plant = bench.build(rig_with(bench.rig, effects))
        self.parameters = self.plant.parameters
        self._engine = Engine(self.plant, brief=True)
        self._offset, self._cycles = bench.offset, bench.cycles
        self._start = np.array([bench.rest.get(state.name, state.start) for state in self.plant.states])

    def behind(self, element: Element) -> "SheetModel":
        """This model, of the same compiled plant, with an element behind it."""
        model = copy(self)
        model.element = element
        model.parameters = (*self.plant.parameters, *(number.free.name for number in element.numbers))
        return model

    def depends_on(self) -> frozenset[str]:
        """Names of the parameters that say anything of the output."""
        plant = self.plant
        x, u, p = (ca.SX.sym(name, plant.f.numel_in(i)) for i, name in enumerate("xup"))
        every = ca.vertcat(plant.f(x, u, p), plant.h(x, u, p)[plant.output(self._output)])
        acts = ca.which_depends(every, p, 1, False)
        return frozenset(name for name, does in zip(plant.parameters, acts, strict=True) if does)

    def deviations(self, sheets: Sequence[SheetPoints], p: np.ndarray) -> list[np.ndarray]:
        """Model less sheet [lanes, k, 2], dB and degrees (in half a turn), of every sheet; p is [lanes, parameters].

        A relative gain is that of the model itself; `offsets` tells what to take off. NaN where the sheet has none.
        """
        own = len(self.plant.parameters)
        deviations = [self._deviation(sheet, p[:, :own]) for sheet in sheets]
        if self.element is None:
            return deviations
        added = self.element.deviations(sheets, p[:, own:])
        return [np.where(a == FAILED, a, in_half_a_turn(a + b)) for a, b in zip(deviations, added, strict=True)]

    def _deviation(self, sheet: SheetPoints, p: np.ndarray) -> np.ndarray:
        lanes, k = len(p), sheet.f.size
        starts = np.tile(self._start, (lanes * k, 1))
        sines = stepped_sines(
            self._engine, starts, self._offset, np.tile(sheet.f, lanes), sheet.amplitude, [self._output], None,
            np.repeat(p, k, axis=0), self._cycles,
        )  # fmt: skip
        response = sines.response[self._output].reshape(lanes, k)
        gain, phase = gain_db(response) - sheet.gain, np.degrees(np.angle(response)) - sheet.phase
        deviation = in_half_a_turn(np.stack((gain, phase), axis=-1))
        lost = ~np.isfinite(gain_db(response))[..., None] & np.isfinite(sheet.values)
        return np.where(lost, FAILED, deviation)


def in_half_a_turn(deviation: np.ndarray) -> np.ndarray:
    """Deviations [..., 2] in dB and degrees with the phase between -180 and 180."""
    return np.stack((deviation[..., 0], (deviation[..., 1] + 180) % 360 - 180), axis=-1)


def offsets(sheets: Sequence[SheetPoints], deviations: Sequence[np.ndarray]) -> np.ndarray:
    """What a sheet's gains have in common [lanes, sheets] in dB, of sheets that tell them up to a constant; else 0."""
    lanes = len(deviations[0])
    shifts = np.zeros((lanes, len(sheets)))
    for column, (sheet, deviation) in enumerate(zip(sheets, deviations, strict=True)):
        if sheet.relative and np.isfinite(sheet.gain).any():
            shifts[:, column] = np.nanmean(deviation[:, :, 0], axis=1)
    return shifts


def errors(deviations: Sequence[np.ndarray], shifts: np.ndarray, sigma: tuple[float, float]) -> np.ndarray:
    """Errors over sigma (dB, degrees), all sheets in a row [lanes, points, 2]; 0 where none is stated."""
    parts = []
    for column, deviation in enumerate(deviations):
        taken = np.stack((shifts[:, column], np.zeros(len(shifts))), axis=-1)[:, None, :]
        parts.append(np.nan_to_num((deviation - taken) / np.array(sigma)))
    return np.concatenate(parts, axis=1)
