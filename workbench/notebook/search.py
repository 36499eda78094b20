"""Tune a loop: its controller's numbers searched by the code of `jackbench tune`."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from ..base.checkpoint import no_checkpoint
from ..base.errors import InputError, nearest
from ..base.units import quantity
from ..commands.tune.options import read_weights
from ..commands.tune.page import cost_figure, numbers_table
from ..commands.tune.study import tuned_rows
from ..control.controller_spec import ControllerSpec
from ..control.protocol import is_number
from ..loop.rig_variations import variation
from ..loop.scenarios import POSITIONS, Scenario, scenario
from ..loop.tuning.goals import Trial
from ..loop.tuning.problem import OF_THE_LOOP, USUAL_WEIGHTS, Searched, TuneProblem, with_number
from ..loop.tuning.search import nearest_trial, search
from ..report import Figure, Table
from ..rigs.rig import Rig
from .closed_loop import ClosedLoop, Quantity

SCENARIOS = {"position": ("position-10mm",), "force": ("force-20kn",)}
_DECADE = 10.0  # a range of a decade and more is searched on a logarithmic scale
Path = tuple[str | int, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Search:
    """Every design that was tried, the start first; `best` is the one whose loop came back."""

    problem: TuneProblem
    trials: Sequence[Trial]

    @property
    def best(self) -> Trial:
        """The design of the least cost."""
        return nearest_trial(self.trials)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The best design's metrics on every rig in every scenario."""
        return tuned_rows(self.problem, self.best)

    def plot(self) -> Figure:
        """The cost of every design that meets the hard goals."""
        return cost_figure(self.trials)

    def table(self) -> Table:
        """The numbers at the start and in the best design."""
        return numbers_table(self.problem, self.trials[0], self.best)

    def __repr__(self) -> str:
        met = sum(trial.verdict.cost is not None for trial in self.trials)
        cost = self.best.verdict.cost
        return f"{len(self.trials)} designs, {met} meet every hard goal; least cost {cost:.4g}\n{self.table()!r}"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_() + self.plot()._repr_html_()


def tune(
    loop: ClosedLoop,
    over: Mapping[str, tuple[Quantity, Quantity]],
    designs: int = 40,
    rigs: Sequence[str] = ("nominal",),
    scenarios: Sequence[str | Scenario] | None = None,
    weights: Mapping[str, float] = USUAL_WEIGHTS,
    seed: int = 1,
    jobs: int = 1,
    positions: Sequence[float] = POSITIONS,
) -> ClosedLoop:
    """The loop with the best of the tried numbers; the hard goals are those of `jackbench tune`.

    Parameters
    ----------
    loop
        The loop whose controller has the numbers.
    over
        Low and high of each searched number by name, "gain" or "pressure-feedback.gain", SI or text with a unit.
    designs
        How many designs are tried.
    rigs
        Names of the set, nominal first (see RIG_SET).
    scenarios
        Names or Scenarios; a step of 10 mm or 20 kN where none are given.
    weights
        Of metrics in the cost: settling_s [1/s], iae over the step [1/s], overshoot_percent [1/%], ms [1].
    seed
        Seed of the search, and of the sensors' noise.
    jobs
        Worker processes.
    positions
        Shares of the stroke limit [1] at which loops are judged.

    Returns
    -------
    The best loop; its `search` has all designs.

    Raises
    ------
    InputError
        For an unknown number, a range that the controller may not have, and where no design meets every goal.
    """
    if not isinstance(loop, ClosedLoop):
        raise InputError("tune: give a ClosedLoop")
    searched = tuple(_searched(loop.controller, name, ends) for name, ends in over.items())
    if not searched:
        raise InputError('tune: nothing is searched; write over={"gain": (low, high)}')
    problem = TuneProblem(
        loop.rig,
        loop.controller,
        searched,
        scenarios_of(loop, scenarios, "tune"),
        checked_rigs(loop, rigs, "tune"),
        read_weights(weights, "tune: weights"),
        designs,
        seed,
        loop.conditions(seed),
        tuple(positions),
    )
    result = Search(problem, search(problem, no_checkpoint, lambda _: None, jobs))
    if missed := result.best.verdict.missed:
        raise InputError(f"tune: none of {designs} designs meets every hard goal; the nearest misses: {missed}")
    controller = problem.design(result.best.values)
    return replace(loop.with_controller(controller.named(f"{loop.controller.name}-tuned")), search=result)


def scenarios_of(loop: ClosedLoop, scenarios: Sequence[str | Scenario] | None, where: str) -> tuple[Scenario, ...]:
    """Scenarios by name or as they are, of the loop's signal. Raises InputError, opened by `where`, for another's."""
    names = SCENARIOS[loop.signal.name] if scenarios is None else scenarios
    result = tuple(scenario(each, where) if isinstance(each, str) else each for each in names)
    if other := [each for each in result if each.signal != loop.signal.name]:
        raise InputError(
            f"{where}: {other[0].name} asks for a {other[0].signal}, the loop controls the {loop.signal.name}"
        )
    return result


def checked_rigs(loop: ClosedLoop, rigs: Sequence[str], where: str) -> dict[str, Rig]:
    """Rigs of the set by name. Raises InputError, opened by `where`."""
    if isinstance(rigs, str) or not rigs or rigs[0] != "nominal" or len(set(rigs)) < len(rigs):
        raise InputError(f'{where}: rigs must be different names, "nominal" first')
    try:
        return {name: variation(loop.rig, name) for name in rigs}
    except InputError as error:
        raise InputError(f"{where}: rigs: {error}") from None


def _searched(controller: ControllerSpec, name: str, ends: tuple[Quantity, Quantity]) -> Searched:
    numbers = _numbers(controller)
    if name not in numbers:
        raise InputError(f'tune: over: no number "{name}"; {nearest(name, numbers)}')
    path, unit, value = numbers[name]
    try:
        low, high = (quantity(end, unit) for end in ends)
    except InputError as error:
        raise InputError(f"tune: over: {name}: {error}") from None
    except (TypeError, ValueError):
        raise InputError(f"tune: over: {name}: write the least and the greatest, such as (1, 10)") from None
    if not low < high:
        raise InputError(f"tune: over: {name}: {low:g} must be below {high:g}")
    for end in (low, high):
        try:
            with_number(controller, path, end, unit)
        except InputError as error:
            raise InputError(f"tune: over: {error}") from None
    log = low > 0 and high / low >= _DECADE
    start = value if low <= value <= high else math.sqrt(low * high) if log else (low + high) / 2
    return Searched(path, unit, low, high, start, log)


def _numbers(controller: ControllerSpec) -> dict[str, tuple[Path, str, float]]:
    """Path, SI unit and value of every number by name: gain, pressure-feedback.gain."""
    numbers: dict[str, tuple[Path, str, float]] = {}
    parts: list[tuple[str, Path, ControllerSpec]] = [("", (), controller)]
    for i, part in enumerate(controller.compensators):
        parts.append((f"{part.name}.", ("compensators", i), part))
    for prefix, path, part in parts:
        for entry in fields(part.design):
            if not is_number(entry):
                continue
            place = (*path, entry.name), entry.metadata["unit"], getattr(part.design, entry.name)
            for name in (f"{prefix}{entry.name}", f"{prefix.replace('-', '_')}{entry.name}"):
                numbers.setdefault(name, place)
    for name, unit in OF_THE_LOOP.items():
        if getattr(controller, name):
            numbers[name] = (name,), unit, getattr(controller, name)
    return numbers
