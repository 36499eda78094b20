"""Sampled loops, linearised, in lanes: closed loop, sensitivity and margins, or the plain word that one is unstable."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..control.protocol import Controller
from ..linear import Equilibrium
from ..linear.state_space import StateSpace, sampled_response
from ..plant import Plant
from .lane_laws import LawLanes, lane_views
from .open_loops import OpenLoops, near, opened, unit_circle
from .sampled_lanes import LaneResponse, SampledLanes, sampled_lane

STABLE = 1 - 1e-9  # |z| of every pole of a stable loop is below this

Source = Literal["linear", "sine", "none"]  # of margins: the linear loop, sines on the simulated one, or there are none


@dataclass(frozen=True)
class LaneMargins:
    """Largest |z| of the poles [lanes]; Ms [1], gain margin [dB] and phase margin [deg] in either direction.

    An unstable loop has NaN for all three, and a loop without such a crossing for a margin.
    """

    radius: np.ndarray
    ms: np.ndarray
    gain_margin_db: np.ndarray
    phase_margin_deg: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """Bool [lanes]."""
        return self.radius < STABLE

    def where(self, ok: np.ndarray, radius: float) -> "LaneMargins":
        """Those of the lanes that are `ok`, the others being unstable with a `radius`."""
        columns = (self.ms, self.gain_margin_db, self.phase_margin_deg)
        return LaneMargins(np.where(ok, self.radius, radius), *(np.where(ok, column, np.nan) for column in columns))

    def some(self, lanes: np.ndarray) -> "LaneMargins":
        """Those of some lanes."""
        columns = (self.radius, self.ms, self.gain_margin_db, self.phase_margin_deg)
        return LaneMargins(*(column[lanes] for column in columns))


@dataclass(frozen=True)
class LinearLoop:
    """A linearised sampled loop over f [k] in Hz up to the Nyquist frequency, closest where it crosses or resonates.

    `closed` is reference -> controlled signal, `sensitivity` 1/(1 + L) at the command. An unstable loop has no margins:
    its gain and phase margin, Ms, closed loop and sensitivity are None. Margins count from 0 Hz to the Nyquist
    frequency, both included; a gain margin above 120 dB is none. `margins` says where they come from: sines give no
    closed loop, and where they give no margins, whether the loop is stable may be None too.
    """

    stable: bool | None
    f: np.ndarray
    open: np.ndarray
    closed: np.ndarray | None
    sensitivity: np.ndarray | None
    gain_margin_db: float | None
    phase_margin_deg: float | None
    ms: float | None
    margins: Source = "linear"


@dataclass(frozen=True)
class LoopLanes:
    """Loops of laws (`lane_laws`) on sampled plants, in lanes."""

    plants: SampledLanes
    law: LawLanes

    @cached_property
    def poles(self) -> np.ndarray:
        """The poles of each loop, z [lanes, n]; what is measured has not heard of this sample's command yet."""
        plants, law = self.plants, self.law
        c = plants.c[:, self._rows]
        u_x, u_w = law.d[:, None, 1:] @ c, np.broadcast_to(law.c[:, None], (len(c), 1, law.c.shape[1]))
        w_x, w_w = law.b[:, :, 1:] @ c, np.broadcast_to(law.a, (len(c), *law.a.shape[1:]))
        top = np.concatenate((plants.a + plants.b @ u_x, plants.b @ u_w), axis=2)
        bottom = np.concatenate((w_x, w_w), axis=2)
        return np.linalg.eigvals(np.concatenate((top, bottom), axis=1)).astype(complex)

    def margins(self, opened: OpenLoops | None = None) -> LaneMargins:
        """Poles and margins of all, of their loops where these are `opened` already; an unstable one needs none."""
        radius = np.abs(self.poles).max(axis=1)
        stable = np.flatnonzero(radius < STABLE)
        columns = np.full((3, len(radius)), np.nan)
        if opened is not None:
            columns[:, stable] = opened.margins[:, stable]
        elif stable.size:
            columns[:, stable] = self.opened(stable).margins
        return LaneMargins(radius, *columns)

    def at(self, lanes: np.ndarray, f: np.ndarray) -> np.ndarray:
        """The loops of lanes [n], broken at the command, complex [n, k] at frequencies [n, k] or [1, k] in Hz."""
        z = unit_circle(f, self.plants.period)
        return -np.sum(self.law.response.some(lanes).at(z) * self._measured.some(lanes).at(z), axis=1)

    def opened(self, lanes: np.ndarray) -> OpenLoops:
        """The loops of some lanes [n], close where the plant, the law or the closed loop resonates."""
        even, count = self.plants.f[None], len(lanes)
        law = self.law.response.some(lanes)
        known = -np.sum(
            law.at(unit_circle(even, self.plants.period)) * self.plants.on_grid[lanes[:, None], self._rows], axis=1
        )
        own = np.broadcast_to(law.modes, (count, law.modes.shape[1]))
        poles = np.concatenate((self.poles[lanes], self._measured.modes[lanes], own), axis=1)
        further = near(poles, self.plants.period)
        f = np.concatenate((np.repeat(even, count, axis=0), further), axis=1)
        loop = np.concatenate((known, self.at(lanes, further)), axis=1)
        order = np.argsort(f, axis=1, kind="stable")
        f, loop = (np.take_along_axis(part, order, axis=1) for part in (f, loop))
        return opened(lambda some, between: self.at(lanes[some], between), f, loop)

    @cached_property
    def _measured(self) -> LaneResponse:
        return self.plants.response.of_outputs(self._rows)

    @property
    def _rows(self) -> list[int]:
        return self.plants.rows(self.law.measures)


def linear_loop(
    plant: Plant, about: Equilibrium, controller: Controller, period: float, p: np.ndarray | None = None
) -> LinearLoop:
    """Close a controller's linear view on the plant linearised at a point, held and sampled every `period` [s].

    A delay of the plant's command counts, exactly. For several designs on one plant, see `linear_loop_on`.
    """
    return linear_loop_on(sampled_lane(plant, about, period, p), controller)


def linear_loop_on(plant: SampledLanes, controller: Controller) -> LinearLoop:
    """Close a controller's linear view on a `sampled_lane`: several designs share what is the plant's."""
    view = lane_views(controller, plant.signals)
    loops = LoopLanes(plant, view.of_loop())
    stable = bool(np.abs(loops.poles).max() < STABLE)
    loop = with_margins(loops.opened(np.zeros(1, int)), stable, "linear")
    if not stable:
        return loop
    return replace(loop, closed=closed_response(plant, view.view(0, plant.period), loop.f, loop.open))


def closed_response(plants: SampledLanes, law: StateSpace, f: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Reference -> controlled signal [k] of the first lane under a law, whose open loop [k] at f [k] in Hz is known."""
    z, controlled = unit_circle(f, plants.period), plants.rows(law.input_labels[1:2])
    forward = plants.response.of_outputs(controlled).some(np.zeros(1, int)).at(z[None])[0, 0]
    return sampled_response(law, z)[0, 0] * forward / (1 + loop)


def with_margins(opened: OpenLoops, stable: bool, margins: Source) -> LinearLoop:
    """The first lane of open loops, without a closed one."""
    f, loop = opened.curve(0)
    if not stable:
        return LinearLoop(False, f, loop, None, None, None, None, None, margins)
    ms, gain, phase = (None if np.isnan(number) else float(number) for number in opened.margins[:, 0])
    return LinearLoop(True, f, loop, None, 1 / (1 + loop), gain, phase, ms, margins)


def closed_poles(plant: SampledLanes, controller: Controller) -> np.ndarray:
    """Poles z [k] of the loop that `linear_loop_on` closes, without the time that its margins take."""
    return LoopLanes(plant, lane_views(controller, plant.signals).of_loop()).poles[0]
