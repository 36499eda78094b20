"""Simulate a plant with inputs held over intervals; which back end runs is the engine's affair."""

import hashlib
from collections.abc import Callable
from copy import copy, deepcopy
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import casadi as ca
import numpy as np

from ..base.errors import InputError
from ..base.private_cache import store, stored
from ..base.recent import Recent
from ..plant import Plant
from .delay_line import Arriving
from .emit import first_unsupported
from .interpreter import InterpretedPlant
from .jobs import Batch, Stepping
from .rosenbrock import adaptive_attempt
from .trajectory import Trajectory

if TYPE_CHECKING:
    from .compiled import CompiledPlant, SampledSteps
    from .object_cache import Library
    from .sampled_code import SampledLaw
    from .sampled_law import LawShape

_LARGE = 3000  # instructions of the rates: below, a graph is made as fast as it is read
TOLERANCE = 1e-5  # local error per step, relative to each state's magnitude
_RATTLING = 0.1  # of it, where something rattles in a gap: every impact makes an error of the one before larger
FIRST_STEP = 2e-5
ATTEMPTS = 20_000  # a held interval that needs more has failed
RATE, BURST = 1e6, 2e5  # a simulated second takes some 1e4; a run that has taken more than these has failed
_LAWS = 8e6  # bytes of the laws that an engine holds as machine code

BackEnd = Literal["auto", "compiled", "interpreted"]


class NotCompiled(RuntimeError):
    """Says in one line why a plant runs through the interpreter."""


def compile_plant(
    attempt: ca.Function,
    outputs: ca.Function,
    p: np.ndarray,
    stepping: Stepping,
    brief: bool = False,
    commands: int = 1,
    batches: bool = False,
) -> "CompiledPlant":
    """Machine code for an attempt (s, u, p, tolerance) -> s and for outputs (x, u, p) -> y.

    `p` are the parameters where a run gives none; `brief`, `commands` and `batches` as CompiledPlant has them. Raises
    NotCompiled for an operation that has no compiled form, and where the compiler is missing or does not work.
    """
    for function in (attempt, outputs):
        if operation := first_unsupported(function):
            raise NotCompiled(f'interpreted: the operation "{operation}" has no compiled form')
    try:
        from .compiled import CompiledPlant

        return CompiledPlant(attempt, outputs, p, stepping, brief, commands, batches)
    except (ImportError, OSError, RuntimeError) as error:
        raise NotCompiled(f"interpreted: no compiler here ({error})") from error


def attempt_of(plant: Plant, make: Callable[[Plant], ca.Function]) -> ca.Function:
    """What `make` makes of a plant, from the cache where it has been made before.

    The key holds the plant's rates and the sizes of its states, which are all that a graph of the engine takes of it,
    and the sources that make it.
    """
    if plant.f.n_instructions() < _LARGE:
        return make(plant)
    parts = [make.__name__, plant.f.serialize(), str(np.asarray(plant.scale).tobytes()), *_sources()]
    name = f"{hashlib.sha256(chr(0).join(parts).encode()).hexdigest()}.graph"
    if content := stored(name):
        return ca.Function.deserialize(content.decode())
    graph = make(plant)
    store(name, graph.serialize().encode())
    return graph


@cache
def _sources() -> tuple[str, ...]:
    folder = Path(__file__).parent
    return (
        ca.CasadiMeta.version(),
        (folder / "rosenbrock.py").read_text(encoding="utf-8"),
    )


class Engine:
    """One plant, ready to run. It remembers nothing: every call is a function of its arguments.

    `back_end` says what runs, "compiled" or "interpreted", and `note` why it is interpreted. Asking for "compiled"
    raises NotCompiled where that is impossible. `brief`: it runs for a few seconds of simulated time only, so that it
    must not take long to compile; every number is the same to the bit. `batches`: it mostly runs lanes together.
    Parameters p [k], or [lanes, k] in batches, are the plant's own when left out. All SI. Inputs are what the plant
    holds: where `plant.delay` says that its command is late, a `DelayLine` tells what that is.
    """

    def __init__(
        self,
        plant: Plant,
        tolerance: float = TOLERANCE,
        back_end: BackEnd = "auto",
        brief: bool = False,
        batches: bool = False,
    ) -> None:
        self.plant = plant
        tolerance *= _RATTLING if plant.gaps else 1.0
        self._stepping = Stepping(tolerance, FIRST_STEP, ATTEMPTS, RATE, BURST)
        graphs = (attempt_of(plant, adaptive_attempt), plant.h, plant.p, self._stepping)
        self._runs, self.back_end, self.note = back_end_of(*graphs, back_end, brief, plant.commands, batches)

    def __getstate__(self) -> dict[str, Any]:
        """Without the addresses of laws, which are of this process."""
        return {name: value for name, value in self.__dict__.items() if name != "_laws"}

    def __deepcopy__(self, memo: dict[int, object]) -> "Engine":
        """With a back end of its own, which has places for one call at a time; the plant is shared, and so are laws as
        far as they are there."""
        other = copy(self)
        other._runs = deepcopy(self._runs, memo)
        return other

    def __repr__(self) -> str:
        """One line: plant, back end, and why it is interpreted if it is."""
        return f"<Engine of {self.plant.name}: {self.note or self.back_end}>"

    def run(self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> Trajectory:
        """From x0 [n] over times t [k + 1], holding row j of u [k or more, m] over [t_j, t_(j+1)].

        Never raises for a failed step: the states from there on are NaN and `failed_at` says when. Raises ValueError
        for times that do not increase.
        """
        batch = self.run_batch(np.asarray(x0)[None], t, u, p)
        failed = int(batch.failed[0])
        failed_at = None if failed < 0 else float(t[failed])
        values = self.plant.p if p is None else p
        return Trajectory(
            np.asarray(t), batch.x[0], int(batch.attempts[0]), failed_at, self.plant, np.asarray(u), values
        )

    def run_batch(
        self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None = None, every: int = 1
    ) -> Batch:
        """From x0 [lanes, n] over times t [k + 1] or [lanes, k + 1]; u [k or more, m] or [lanes, k or more, m].

        Keeps every `every`-th state. A lane that fails is marked and does not touch the others. Raises ValueError for
        times that do not increase.
        """
        durations = np.diff(t)
        if not np.all((durations > 0) & np.isfinite(durations)):
            raise ValueError(f"{self.plant.name}: times must be finite and increasing")
        return self._runs.run_batch(x0, t, u, p, every)

    def advance(self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray | None = None) -> np.ndarray | None:
        """State after holding u [m] for `duration` [s], tried in one step first; None if the steps failed.

        Raises ValueError for a duration that is not positive.
        """
        if not duration > 0:
            raise ValueError(f"{self.plant.name}: a duration of {duration} s; it must be positive")
        return self._runs.advance(x, u, duration, p)

    def advance_arriving(
        self, x: np.ndarray, u: np.ndarray, arriving: Arriving, period: float, p: np.ndarray | None = None
    ) -> np.ndarray | None:
        """`advance` over a `period` [s] in which commands arrive, as `DelayLine.send` says; u holds the last one then,
        or the one with which the steps failed."""
        for command, share in arriving:
            u[: self.plant.commands] = command
            after = self.advance(x, u, share * period, p)
            if after is None:
                return None
            x = after
        return x

    def advance_batch(
        self, x: np.ndarray, u: np.ndarray, duration: float | np.ndarray, p: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """`advance` for x [lanes, n], u [lanes, m], one duration or [lanes]: states and which lanes failed, bool
        [lanes]; theirs are NaN."""
        return self._runs.advance_batch(x, u, duration, p)

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Outputs [outputs] at one state and input, for a loop that asks every period."""
        return self._runs.observe(x, u, p)

    def run_sampled(
        self,
        shape: "LawShape",
        x0: np.ndarray,
        durations: np.ndarray,
        state: np.ndarray,
        rows: np.ndarray,
        numbers: np.ndarray,
        every: int = 1,
        p: np.ndarray | None = None,
    ) -> tuple[Batch, np.ndarray]:
        """Closed loops of a sampled law, or of one for each jack of a platform, from x0 [lanes, n]; `state` changes in
        place. See CompiledPlant.run_sampled.

        Raises NotCompiled where the plant runs through the interpreter.
        """
        sample = self._sample(shape, len(x0))["sample"]
        return self._compiled.run_sampled(sample, x0, durations, state, rows, numbers, shape.width_out, every, p)

    def sampled_steps(
        self, shape: "LawShape", durations: np.ndarray, state: np.ndarray, rows: np.ndarray, numbers: np.ndarray
    ) -> "SampledSteps":
        """`run_sampled` of lanes [lanes, k] of `state` and `rows` prepared for many calls over the same arrays. Raises
        NotCompiled as that does."""
        from .compiled import SampledSteps

        sample = self._sample(shape, len(rows))
        return SampledSteps(self._compiled, sample, durations, state, numbers, rows, shape.width_out)

    @property
    def _compiled(self) -> "CompiledPlant":
        if self.back_end != "compiled":
            raise NotCompiled(f"{self.note}; a sampled law runs compiled only")
        return cast("CompiledPlant", self._runs)

    def _sample(self, shape: "LawShape", lanes: int) -> "Library":
        """The machine code of a law, for so many lanes."""
        in_blocks = self._compiled.in_blocks(lanes)
        law = self._law(shape)
        return law.block if in_blocks else law.single

    def has_law(self, shape: "LawShape") -> bool:
        """Whether the machine code of a sampled law is there."""
        return shape in self._laws

    def _law(self, shape: "LawShape") -> "SampledLaw":
        """The law of a shape, compiled once; of those made the latest stay."""
        from .sampled_code import compile_law

        return self._laws.get(shape, lambda: compile_law(self.plant, shape))

    @cached_property
    def _laws(self) -> "Recent[LawShape, SampledLaw]":
        return Recent(_LAWS, lambda law: law.single.size + law.block.size)

    def check_pace(self, attempts: int, seconds: float) -> None:
        """Raises InputError for so many attempts of a run that failed within so many seconds, where it was given up:
        then the rig's numbers are to blame."""
        if self._stepping.spent(attempts, seconds):
            what = f"a simulated second takes more than {RATE:.0f} steps of integration"
            raise InputError(f"{self.plant.name}: {what}; check the rig's stiffnesses, gains, volumes and masses")

    def outputs(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Outputs [rows, outputs] or [lanes, rows, outputs] for x of rows or lanes of rows; u and p are broadcast."""
        return self._runs.outputs(x, u, p)


def back_end_of(
    attempt: ca.Function,
    outputs: ca.Function,
    p: np.ndarray,
    stepping: Stepping,
    back_end: BackEnd,
    brief: bool = False,
    commands: int = 1,
    batches: bool = False,
) -> "tuple[CompiledPlant | InterpretedPlant, str, str]":
    """A back end for graphs of an attempt and of outputs, its name, and why it is interpreted if it is."""
    note = "interpreted: asked for"
    if back_end != "interpreted":
        try:
            return compile_plant(attempt, outputs, p, stepping, brief, commands, batches), "compiled", ""
        except NotCompiled as error:
            if back_end == "compiled":
                raise
            note = str(error)
    return InterpretedPlant(attempt, outputs, p, stepping), "interpreted", note
