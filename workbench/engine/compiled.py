"""A plant as machine code: one trajectory, or batches of them over vector lanes and threads."""

import ctypes
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, partial
from threading import Event, Thread, current_thread, main_thread
from time import sleep

import casadi as ca
import numpy as np

from ..base.cores import cores
from . import object_cache
from .codegen import module
from .jobs import Batch, OutputJob, RunJob, Stepping

_SHORT = 1000  # intervals, of a ms each some us: where nothing is absurd, they are over before a Ctrl-C is missed
_SHORT_LOOK = 20_000  # rows of outputs, of some ns each
_LONG = 20_000  # instructions of an attempt, for one lane of which the compiler takes seconds
_WORTH_A_THREAD = 2000  # intervals or rows: to start another thread takes about as long as fewer of them


class _Kernel:
    """Machine code of one plant for one number of lanes. A copy shares it; where it is unpickled it is made anew."""

    def __init__(
        self, attempt: ca.Function, outputs: ca.Function, width: int, commands: int, hasty: bool = False
    ) -> None:
        self._made_of, self.width = (attempt, outputs, width, commands, hasty), width
        write = partial(module, attempt, outputs, width, object_cache.fused(), commands)
        names = "run", "outputs"
        self.library = object_cache.load(_key(attempt, outputs, width, commands), write, names, hasty=hasty)
        self.run, self.outputs = (ctypes.CFUNCTYPE(None, ctypes.c_void_p)(self.library[name]) for name in names)

    def __deepcopy__(self, memo: dict[int, object]) -> "_Kernel":
        return self

    def __reduce__(self) -> tuple[object, ...]:
        return _Kernel, self._made_of


def _key(attempt: ca.Function, outputs: ca.Function, width: int, commands: int) -> tuple[str, ...]:
    """What tells the code of one plant for so many lanes from every other."""
    return attempt.serialize(), outputs.serialize(), str(width), str(object_cache.fused()), str(commands)


class CompiledPlant:
    """Runs an attempt (s, u, p, tolerance) -> s, s = [x, time left, step, attempts], and outputs h(x, u, p).

    `p` are the parameters where none are given. `batches`: it runs lanes together, so that code for blocks of them is
    made at once, and that for one lane only where it is asked for. `brief`: it runs for a few seconds of simulated time
    only, so that blocks are compiled in haste, or without `batches` not at all, where they were not compiled before,
    and one lane of a long plant in haste too; every number is the same to the bit. The first `commands` inputs may
    change inside the period of a sampled law. `advance` and `observe` reuse their buffers: one thread at a time. Raises
    RuntimeError or OSError if this machine cannot compile.
    """

    def __init__(
        self,
        attempt: ca.Function,
        outputs: ca.Function,
        p: np.ndarray,
        stepping: Stepping,
        brief: bool = False,
        commands: int = 1,
        batches: bool = False,
    ) -> None:
        self._attempt, self._h, self._commands = attempt, outputs, commands
        self._brief, self._batches = brief, batches
        self._p, self._stepping = np.array(p, dtype=float), stepping
        self._n, self._m, self._k = outputs.numel_in(0), outputs.numel_in(1), outputs.numel_out(0)
        self._bench = CallBuffers(self._n, self._m, self._p, self._k, stepping)
        self._of(2 if batches else 1)  # a machine that cannot compile shows here

    @cached_property
    def _single(self) -> _Kernel:
        long = self._attempt.n_instructions() > _LONG
        return _Kernel(self._attempt, self._h, 1, self._commands, hasty=self._brief and long)

    @cached_property
    def _block(self) -> _Kernel:
        plant = self._attempt, self._h, object_cache.vector_width(), self._commands
        if self._brief and not self._batches and not object_cache.compiled(_key(*plant)):
            return self._single
        return _Kernel(*plant, hasty=self._brief)

    def _of(self, lanes: int) -> _Kernel:
        """The code that runs so many lanes."""
        return self._block if lanes > 1 or (self._brief and self._batches) else self._single

    def in_blocks(self, lanes: int) -> bool:
        """Whether so many lanes run in blocks, for which code that is called from them has to be made."""
        return self._of(lanes).width > 1

    def run_batch(
        self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None = None, every: int = 1
    ) -> Batch:
        """From x0 [lanes, n] over times t [lanes, k + 1], holding row j of u over [t_j, t_(j+1)].

        t, u [lanes, k or more, m] and p [lanes, np] may leave out the lanes. Every `every`-th state is kept. A lane
        that fails is marked and does not touch the others. Raises ValueError for shapes that do not fit and for times
        that do not increase.
        """
        return self._run(x0, t, u, p, every, self._stepping.first_step)

    def advance_batch(
        self, x: np.ndarray, u: np.ndarray, duration: float | np.ndarray, p: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """States [lanes, n] after holding u [lanes, m] for `duration` [s] or [lanes], tried in one step first, and
        which lanes failed, bool [lanes]: theirs are NaN."""
        x, u, p = (np.ascontiguousarray(a, dtype=float) for a in (x, u, self._p if p is None else p))
        lanes, durations = len(x), np.array(duration, dtype=float)
        self._check(x, durations[..., None], u[..., None, :], p)
        after, attempts, failed = np.empty((lanes, self._n)), np.empty(lanes, np.int64), np.full(lanes, -1)
        job = RunJob(
            **_addresses(x0=x, duration=durations, u=u, p=p, attempts=attempts, failed=failed),
            x=after.ctypes.data - x.itemsize * self._n,  # where the start would stand, which is not stored
            **_counts(lanes, 1, 1, 1),
            **_lane_strides(t=durations[..., None], u=u[..., None, :], p=p),
            **self._limits(float(durations.max())),
        )
        _share(self._of(lanes).run, job, lanes, 1)
        lost = failed >= 0
        if np.count_nonzero(lost):
            after[lost] = np.nan
        return after, lost

    def advance(self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray | None = None) -> np.ndarray | None:
        """State after holding u [m] for `duration` [s], tried in one step first; None if the steps failed."""
        return self._bench.reached.copy() if self._advanced(x, u, duration, p) else None

    def _advanced(self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray | None) -> bool:
        """Whether the steps went well; then the buffer has the state after the duration."""
        bench, job = self._bench, self._bench.run_job
        bench.set(x, u, p)
        bench.duration[0] = job.first_step = duration
        job.next = 0
        self._single.run(bench.run_address)
        if bench.failed[0] < 0:
            return True
        bench.failed[0] = -1
        return False

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Outputs [outputs] at one state and input."""
        bench = self._bench
        bench.set(x, u, p)
        bench.output_job.next = 0
        self._single.outputs(bench.output_address)
        return bench.y.copy()

    def outputs(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """y [..., outputs] for x [rows, n] or [lanes, rows, n]; u [..., m] and p [..., np] are broadcast to them."""
        x = np.ascontiguousarray(x, dtype=float)
        if x.ndim not in (2, 3) or x.shape[-1] != self._n:
            raise ValueError(f"x {x.shape}: expected [rows, {self._n}] or [lanes, rows, {self._n}]")
        y = np.empty((*x.shape[:-1], self._k))
        lanes, rows = (x.shape[0], x.shape[1]) if x.ndim == 3 else (1, len(x))
        u, p = (_spread(a, y.shape[:-1]) for a in (u, self._p if p is None else p))
        strides = [s // 8 for a in (u, p) for s in (0, 0, *a.strides[:-1])[-2:]]
        if rows == 1:  # one row a lane is as good as one lane of all rows
            lanes, rows, strides = 1, lanes, [0, strides[0], 0, strides[2]]
        job = OutputJob(*(a.ctypes.data for a in (x, u, p, y)), 0, lanes, rows, *strides)
        _share(self._of(lanes * rows).outputs, job, lanes, rows)
        return y

    def _run(
        self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None, every: int, first_step: float
    ) -> Batch:
        x0, t, u, p = (np.ascontiguousarray(a, dtype=float) for a in (x0, t, u, self._p if p is None else p))
        lanes, durations = len(x0), np.diff(t)
        rows = durations.shape[-1]
        self._check(x0, durations, u, p)
        x = np.empty((lanes, rows // every + 1, self._n))
        x[:, 0] = x0
        attempts, failed = np.zeros(lanes, dtype=np.int64), np.full(lanes, -1)
        job = RunJob(
            **_addresses(x0=x0, duration=durations, u=u, p=p, x=x, attempts=attempts, failed=failed),
            **_counts(lanes, rows, every, x.shape[1]),
            **_lane_strides(t=durations, u=u, p=p),
            **self._limits(first_step),
        )
        if rows:
            _share(self._of(lanes).run, job, lanes, rows)
        for lane in np.flatnonzero(failed >= 0):
            x[lane, failed[lane] // every + 1 :] = np.nan
        return Batch(x, attempts, failed)

    def run_sampled(
        self,
        sample: int,
        x0: np.ndarray,
        durations: np.ndarray,
        law: np.ndarray,
        rows_in: np.ndarray,
        numbers: np.ndarray,
        width_out: int,
        every: int,
        p: np.ndarray | None = None,
    ) -> tuple[Batch, np.ndarray]:
        """A batch as `run_batch` makes it, its inputs given by a law's sampling instants: machine code at address
        `sample`.

        durations [parts] or [lanes, parts] of the intervals of one period; law [lanes, states], which goes on to the
        last instant's; rows_in [lanes or 1, instants, k]; numbers [lanes or 1, k]. Every `every`-th instant's state is
        kept. Returns the batch and what each instant puts out [lanes, instants, width_out]; NaN where a lane has failed
        before.
        """
        lanes, instants, parts = len(x0), rows_in.shape[1], durations.shape[-1]
        x0, rows_in, numbers, p = (
            np.ascontiguousarray(a, dtype=float) for a in (x0, rows_in, numbers, self._p if p is None else p)
        )
        t = np.ascontiguousarray(np.tile(durations, instants))
        x = np.empty((lanes, instants // every + 1, self._n))
        x[:, 0] = x0
        out = np.full((lanes, instants, width_out), np.nan)
        attempts, failed = np.zeros(lanes, dtype=np.int64), np.full(lanes, -1)
        places = {"x0": x0, "duration": t, "p": p, "law": law, "rows_in": rows_in, "numbers": numbers, "rows_out": out}
        places |= {"attempts": attempts, "failed": failed}
        job = self._sampled_job(sample, parts, every, x.shape[1], places, x.ctypes.data)
        _share(self._of(lanes).run, job, lanes, instants * parts)
        for lane in np.flatnonzero(failed >= 0):
            x[lane, failed[lane] // (parts * every) + 1 :] = np.nan
        return Batch(x, attempts, np.where(failed < 0, -1, failed // parts)), out

    def _sampled_job(
        self, sample: int, parts: int, every: int, records: int, places: dict[str, np.ndarray], x: int
    ) -> RunJob:
        """The job of all arrays by their names in it, `records` of a lane's states from the address x on."""
        t, into, out = (places[name] for name in ("duration", "rows_in", "rows_out"))
        lanes, instants = out.shape[:2]
        return RunJob(
            **_addresses(**places, u=t),
            **_counts(lanes, instants * parts, every * parts, records),
            **_lane_strides(t=t, **{name: places[name] for name in ("p", "law", "numbers")}),
            **_lane_strides(**{"in": into, "out": out}),
            **self._limits(float(t.flat[0])),
            x=x,
            sample=sample,
            parts=parts,
            in_row=into.shape[2],
            out_row=out.shape[2],
        )

    def _limits(self, first_step: float) -> dict[str, float]:
        return {"first_step": first_step, **self._stepping.limits}

    def _check(self, x0: np.ndarray, durations: np.ndarray, u: np.ndarray, p: np.ndarray) -> None:
        lanes, rows, k = len(x0), durations.shape[-1], len(self._p)
        fits = x0.shape == (lanes, self._n) and u.ndim in (2, 3) and u.shape[-1] == self._m and u.shape[-2] >= rows
        fits = fits and durations.shape[:-1] in ((), (lanes,))
        if not (fits and u.shape[:-2] in ((), (lanes,)) and p.shape in ((k,), (lanes, k))):
            raise ValueError(f"shapes do not fit: x0 {x0.shape}, {rows} intervals, u {u.shape}, p {p.shape}")
        if not np.all((durations > 0) & np.isfinite(durations)):
            raise ValueError("times must be finite and increasing")


class CallBuffers:
    """Fixed places for a loop that asks once a period, so that a call prepares nothing. A copy has places of its own:
    nothing stays in them from call to call."""

    def __init__(self, n: int, m: int, p: np.ndarray, outputs: int, stepping: Stepping) -> None:
        self._made_of = n, m, p.copy(), outputs, stepping
        self._own, self._has_own = p.copy(), True
        self.x, self.u, self.p = np.zeros(n), np.zeros(m), p.copy()
        self.duration, self.states, self.y = np.zeros(1), np.zeros((2, n)), np.zeros(outputs)
        self.reached = self.states[1]
        self._attempts, self.failed = np.zeros(1, dtype=np.int64), np.full(1, -1)
        run = {"x0": self.x, "duration": self.duration, "u": self.u, "p": self.p, "x": self.states}
        run |= {"attempts": self._attempts, "failed": self.failed}
        limits = {"first_step": stepping.first_step, **stepping.limits}
        self.run_job = RunJob(**_addresses(**run), **_counts(1, 1, 1, 2), **limits)
        self.output_job = OutputJob(*(a.ctypes.data for a in (self.x, self.u, self.p, self.y)), 0, 1, 1, 0, 0, 0, 0)
        self.run_address, self.output_address = map(ctypes.addressof, (self.run_job, self.output_job))

    def __reduce__(self) -> tuple[object, ...]:
        return CallBuffers, self._made_of

    def set(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None) -> None:
        """Put down the arguments of the next call."""
        self.x[:], self.u[:] = x, u
        if p is not None or not self._has_own:
            self.p[:], self._has_own = self._own if p is None else p, p is None


class SampledSteps:
    """Lanes of a sampled law that go on by some instants at each `advance`, in fixed places, so that a call prepares
    nothing. The places are the caller's to fill.

    States x [lanes, n], which stay where a lane fails; parameters p [lanes, np]; of the law its state law [lanes, k],
    numbers [lanes or 1, k] and rows [lanes, instants, k]; out [lanes, instants, k], what the instants put out, and
    nothing new after a lane has failed; t [parts of all instants] or [lanes, those], s; u [lanes, m], inputs of
    `observe`.
    """

    def __init__(
        self,
        plant: CompiledPlant,
        sample: object_cache.Library,
        durations: np.ndarray,
        law: np.ndarray,
        numbers: np.ndarray,
        rows: np.ndarray,
        width_out: int,
    ) -> None:
        """The steps of the law's machine code, over arrays as `run_sampled` has them."""
        lanes, instants, _ = rows.shape
        self.x, self.u, self.p, self._y = (np.zeros((lanes, k)) for k in (plant._n, plant._m, len(plant._p), plant._k))
        self.law, self.numbers, self.rows = law, numbers, rows
        self.t, self.out = np.tile(durations, instants), np.zeros((lanes, instants, width_out))
        self._attempts, self._failed = np.zeros(lanes, np.int64), np.full(lanes, -1)
        self._size = lanes, instants * durations.shape[-1]
        places = {"x0": self.x, "duration": self.t, "p": self.p, "law": law, "rows_in": rows, "numbers": numbers}
        places |= {"rows_out": self.out, "attempts": self._attempts, "failed": self._failed}
        before = self.x.ctypes.data - self.x.itemsize * plant._n  # where the start would stand, which is not stored
        self._run = plant._sampled_job(sample["sample"], durations.shape[-1], instants, 1, places, before)
        strides = 0, 1, lanes, 0, plant._m, 0, len(plant._p)  # all lanes are rows of one
        self._look = OutputJob(*(a.ctypes.data for a in (self.x, self.u, self.p, self._y)), *strides)
        self._kernel, self._sample = plant._of(lanes), sample  # held: the jobs have addresses

    def advance(self) -> np.ndarray:
        """Go on; which lanes failed, bool [lanes]."""
        self._run.next = 0
        self._failed.fill(-1)
        _share(self._kernel.run, self._run, *self._size)
        return self._failed >= 0

    def observe(self) -> np.ndarray:
        """Outputs [lanes, h] of the states x under the inputs u, in an array that the next call fills anew."""
        self._look.next = 0
        _share(self._kernel.outputs, self._look, 1, len(self.x))
        return self._y


def _addresses(**arrays: np.ndarray) -> dict[str, int]:
    return {name: array.ctypes.data for name, array in arrays.items()}


def _counts(lanes: int, rows: int, every: int, records: int) -> dict[str, int]:
    return {"lanes": lanes, "rows": rows, "every": every, "records": records}


def _lane_strides(**arrays: np.ndarray) -> dict[str, int]:
    """Numbers from one lane to the next: 0 where all lanes share them, a single lane or none having been given."""
    shared = {"t": 1, "u": 2, "p": 1}
    return {
        f"{name}_lane": 0 if a.ndim <= shared.get(name, 0) or len(a) == 1 else a[0].size for name, a in arrays.items()
    }


def _spread(array: np.ndarray, lead: tuple[int, ...]) -> np.ndarray:
    """The array as [*lead, its last axis], without a copy of what repeats."""
    array = np.ascontiguousarray(array, dtype=float)
    if array.shape[:-1] == lead:
        return array
    return np.broadcast_to(array, (*lead, array.shape[-1]))


def _share(call: Callable[[int], None], job: RunJob | OutputJob, lanes: int, rows: int) -> None:
    """Run a job on as many threads as it is worth; each takes the next lane that nobody has.

    Python hears of signals (Ctrl-C) in its main thread alone, and not in machine code: it waits for a job that may take
    long, and stops it before it goes on with an exception.
    """
    address = ctypes.addressof(job)
    if lanes * rows <= (_SHORT if isinstance(job, RunJob) else _SHORT_LOOK):
        if lanes * rows:
            call(address)
        return
    threads = min(cores(), lanes, 1 + lanes * rows // _WORTH_A_THREAD)
    waits = current_thread() is main_thread()
    ends = [Event() for _ in range(threads if waits else threads - 1)]  # a join that is interrupted loses its thread
    for end in ends:
        Thread(target=_run_to, args=(call, address, end)).start()
    try:
        if not waits:
            call(address)
        for end in ends:
            end.wait()
    except BaseException:
        job.stop()
        while not all(end.is_set() for end in ends):  # they are at our arrays
            with suppress(KeyboardInterrupt):
                sleep(0.001)
        raise


def _run_to(call: Callable[[int], None], address: int, end: Event) -> None:
    call(address)
    end.set()
