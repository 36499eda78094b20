"""A rig with a controller: what it does over time, how stable it is, how fast."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..base.errors import InputError
from ..base.signals import Signal
from ..base.units import from_si, quantity
from ..commands.common.sines import loop_poles
from ..control.controller_spec import ControllerSpec
from ..linear.state_space import StateSpace, as_state_space
from ..loop.describing_function import closed_loop_sweep, sweep_frequencies
from ..loop.designed_inverse import designed_inverse, outer_loop
from ..loop.margins import closed_poles
from ..loop.rig_variations import Conditions, with_delay
from ..loop.rows import LinearLoops, LoopSetup, linear_loops, loop_setup, play
from ..loop.scenarios import Scenario, scenario
from ..rigs.rig import Rig
from ..rigs.rig_file import load_rig
from .closed_loop_bode import ClosedLoopBode
from .inverse import Inverse
from .stability import Margins, Poles
from .time_response import TimeResponse

if TYPE_CHECKING:
    import control

    from .search import Search

Quantity = float | str
_SECONDS = {"position": 3.0, "force": 1.0}  # s


@dataclass(frozen=True, eq=False, repr=False)
class ClosedLoop:
    """A controller on a rig, behind the rig's guard, sampled at the rig's control period.

        loop = ClosedLoop(load_rig("jack-10t"), P(gain=3.7) + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz"))

    `rig` may be a name. The controller says which signal is controlled, the position or the force. Numbers are SI, or
    text with a unit. The loop has its computing delay, and its sensors noise and resolution; an `ideal` one has none of
    them. `search` is how `tune` came to the controller. Raises InputError for a controller that cannot be built, and
    for one that needs a sensor or a specimen that the rig does not have.
    """

    rig: Rig
    controller: ControllerSpec
    search: "Search | None" = None
    ideal: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.rig, Rig):
            object.__setattr__(self, "rig", load_rig(self.rig))
        if not isinstance(self.controller, ControllerSpec):
            raise InputError(f"ClosedLoop: {self.controller!r} is no controller; give one such as P(gain=3.7)")
        if self.controller.is_compensator:
            raise InputError(f"ClosedLoop: {self.controller.name} is a compensator; add it to a controller")
        object.__setattr__(self, "controller", self.controller.knowing(self.rig))
        if missing := [name for name in self._measures if name not in self.rig.sensors]:
            raise InputError(f"ClosedLoop: rig {self.rig.name} has no {missing[0]} sensor, which the controller needs")
        if self.signal.name == "force" and not self.rig.specimen_stiffness:
            raise InputError(
                f"ClosedLoop: on rig {self.rig.name} a force has nothing to act on; give it a specimen: "
                "rig.with_values(ks=1e7, cs=1e3)"
            )

    @cached_property
    def _measures(self) -> tuple[str, ...]:
        law = self.controller.build(self.rig.period.value)
        for name in ("measures", "reset", "compute", "update"):
            if not hasattr(law, name):
                raise InputError(f"ClosedLoop: {self.controller.name} has no {name}; see wb.Controller")
        return law.measures

    @property
    def signal(self) -> Signal:
        """The controlled signal."""
        return self.rig.signal(self._measures[0])

    @cached_property
    def setup(self) -> LoopSetup:
        """Engine and operating points of the rig with the loop's computing delay."""
        return loop_setup(with_delay(self.rig, self.delay))

    @property
    def delay(self) -> float:
        """Computing delay [s]: the controller's own, or the rig's; none where the loop is ideal."""
        return self.conditions().delay(self.controller, self.rig)

    def conditions(self, seed: int = 0) -> Conditions:
        """What the loop is judged under, its sensors' noise drawn from a seed."""
        return Conditions(self.ideal, seed)

    @cached_property
    def linear_loops(self) -> LinearLoops:
        """The loop linearised at null and moving, or tried by sines there."""
        return linear_loops(self.controller, self.setup)

    def with_controller(self, controller: ControllerSpec) -> "ClosedLoop":
        """The loop of this rig under another controller."""
        loop = ClosedLoop(self.rig, controller, ideal=self.ideal)
        if "setup" in self.__dict__ and loop.delay == self.delay:
            loop.__dict__["setup"] = self.setup
        return loop

    def step(
        self,
        size: Quantity,
        seconds: Quantity | None = None,
        start: Quantity | None = None,
        seed: int = 0,
    ) -> TimeResponse:
        """A step of the reference by `size` [m or N], watched for `seconds` [s], from rest.

        `start` is the position [m] from mid stroke, `seed` that of the sensors' noise.
        """
        signal, height = self.signal, quantity(size, self.signal.si)
        if height == 0:
            raise InputError("step: the size is 0; give one that is not")
        shown = f"{float(from_si(height, signal.unit, signal.si)):g} {signal.unit}"
        asked = Scenario(f"{signal.name} step of {shown}", signal.name, height, self._seconds(seconds))
        return self._play(asked, start, seed)

    def follow(
        self,
        reference: str | Scenario | ArrayLike | Callable[[np.ndarray], ArrayLike],
        seconds: Quantity | None = None,
        start: Quantity | None = None,
        seed: int = 0,
    ) -> TimeResponse:
        """Follow a reference, in deviations [m or N] from the start.

        It is samples [k], one for each control period; or a function of times [k] s, over `seconds` [s]; or a scenario
        or the name of one, such as "position-ramp". `start` and `seed` are those of `step`.
        """
        if isinstance(reference, str):
            reference = scenario(reference, "follow")
        if not isinstance(reference, Scenario):
            reference = self._sampled(reference, seconds)
        if reference.signal != self.signal.name:
            raise InputError(
                f"follow: {reference.name} asks for a {reference.signal}, the loop controls the {self.signal.name}"
            )
        return self._play(reference, start, seed)

    def margins(self) -> Margins:
        """Stability and margins at null and moving."""
        return Margins(self.linear_loops.null, self.linear_loops.moving, self.signal)

    def poles(self) -> Poles:
        """Poles of the sampled closed loop at null and moving. Raises NoLinearView where the controller has no such."""
        period, setup = self.rig.period.value, self.setup
        controller = self.controller.build(period)
        null, moving = (closed_poles(plant, controller) for plant in (setup.null_plant, setup.moving_plant))
        return Poles(null, moving, period, self.signal)

    def inverse(
        self, *others: "ClosedLoop", preview: Quantity = "80 ms", length: Quantity = "300 ms", band: Quantity = "5 Hz"
    ) -> Inverse:
        """A filter of the reference that undoes this loop and `others` as well as it can, at null and moving.

        It knows the reference a `preview` [s] ahead, has a `length` [s], and is made for references that move within a
        `band` [Hz]. Raises InputError for a loop that is unstable or has no linear view.
        """
        period = self.rig.period.value
        points = [point for loop in (self, *others) for point in (loop.linear_loops.null, loop.linear_loops.moving)]
        ahead, taps = (round(quantity(value, "s") / period) for value in (preview, length))
        return Inverse(designed_inverse(points, period, ahead, taps, quantity(band, "Hz")))

    def margins_through(self, outer: "StateSpace | control.StateSpace", inverse: Inverse | None = None) -> Margins:
        """Margins at null and moving of a loop that closes through the reference: r = H(z) G(z) y.

        G, `outer`, is a system at the control period from measured signals, which are its input labels, such as
        "force", to "reference"; H is an inverse before the loop.
        """
        controller, before = self.controller.build(self.rig.period.value), inverse and inverse.design
        plants = self.setup.null_plant, self.setup.moving_plant
        null, moving = (outer_loop(plant, controller, as_state_space(outer), before) for plant in plants)
        return Margins(null, moving, self.signal)

    def bode(
        self, amplitude: Quantity | None = None, low: Quantity = 0.1, high: Quantity = 50.0, points: int = 20
    ) -> ClosedLoopBode:
        """Reference -> controlled signal: linear at null, or with an `amplitude` by stepped sine, `low` to `high` [Hz].

        The amplitude is in m or N, or text such as "5 mm"; "10 %" is a share of the rig's stroke or force limit.
        """
        name, linear = self.controller.name, self.linear_loops
        if amplitude is None:
            if linear.null.margins != "linear":
                raise InputError(f"bode: {name} has no linear view; give an amplitude for a stepped sine")
            if linear.null.closed is None:
                raise InputError(
                    f"bode: {name} is unstable at null, where its linear loop has no response; see margins()"
                )
            return ClosedLoopBode(name, self.signal, linear, linear.null.f, linear.null.closed, None, "")
        size, setup, period = self._amplitude(amplitude), self.setup, self.rig.period.value
        f = sweep_frequencies(
            quantity(low, "Hz"), quantity(high, "Hz"), points, period, loop_poles(self.controller, setup)
        )
        sine = closed_loop_sweep(setup.engine, self.rig, lambda: self.controller.build(period), setup.null, f, size)
        shown = f"{float(from_si(size, self.signal.unit, self.signal.si)):g} {self.signal.unit}"
        response = np.asarray(sine.response[self.signal.name], complex)
        return ClosedLoopBode(name, self.signal, linear, sine.f, response, sine, shown)

    def code(self, folder: str | Path, linear: bool = False) -> str:
        """Leave the controller in a new folder, as `jackbench coefficients --out` does: C, Structured Text, JSON, .mat,
        and a program that runs it at a rig behind a wire; a sentence that says so.

        `linear`: its linear view at mid stroke alone. Raises InputError for a controller that only computes in Python.
        """
        from ..commands.coefficients.folder import leave_laws
        from ..commands.coefficients.laws import exported

        laws, notes = exported(self.rig, [self.controller], linear)
        if not laws:
            raise InputError("; ".join(notes))
        return leave_laws(Path(folder), self.rig, laws)

    def fmu(self, folder: str | Path) -> str:
        """Leave the loop in a new folder as an FMU, as `jackbench fmu` does; a sentence that says so."""
        from ..commands.fmu.archive import leave_fmu
        from ..commands.fmu.model import fmu_model

        name = f"{self.rig.name}-{self.controller.name}.fmu"
        return leave_fmu(Path(folder), name, fmu_model(with_delay(self.rig, self.delay), self.controller))

    def _amplitude(self, amplitude: Quantity) -> float:
        if isinstance(amplitude, str) and amplitude.rstrip().endswith("%"):
            return quantity(amplitude, "1") * self.rig.limit("force" if self.signal.name == "force" else "stroke")
        return quantity(amplitude, self.signal.si)

    def _seconds(self, seconds: Quantity | None) -> float:
        watched = _SECONDS[self.signal.name] if seconds is None else quantity(seconds, "s")
        if watched < (period := self.rig.period.value):
            raise InputError(f"seconds: {watched:g} s is shorter than the control period of {period:g} s")
        return watched

    def _sampled(self, reference: ArrayLike | Callable[[np.ndarray], ArrayLike], seconds: Quantity | None) -> Scenario:
        """A reference of one's own as a scenario."""
        period = self.rig.period.value
        if callable(reference):
            t = np.arange(round(self._seconds(seconds) / period) + 1) * period
            reference = np.broadcast_to(np.asarray(reference(t), float), t.shape)
        values = np.asarray(reference, float)
        if values.ndim != 1 or len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(
                f"follow: a reference is finite samples [k], two or more; this has the shape {values.shape}"
            )
        span, t = float(np.ptp(values)), np.arange(len(values)) * period
        waveform = tuple(t.tolist()), tuple(values.tolist())
        return Scenario("reference", self.signal.name, span, float(t[-1]), waveform=waveform)

    def _play(self, asked: Scenario, start: Quantity | None, seed: int) -> TimeResponse:
        if start is not None:
            asked = replace(asked, start=quantity(start, "m"), start_share=0.0)
        noise = self.conditions(seed).noise
        return TimeResponse(self, asked, play(self.controller, asked, self.setup, noise), seed)

    def __repr__(self) -> str:
        period = self.rig.period.value * 1e3
        return f"ClosedLoop of the {self.signal.name} on {self.rig.name}, {period:g} ms\n{self.controller!r}"
