"""Predictive laws for tests: of one design, the shipped ones, and what their kernel finds where a state is given."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from controllers.mpc import Mpc
from workbench.commands.run.options import load_config
from workbench.control.law import LawController
from workbench.control.mpc_qp import Braking, ReferenceGovernor
from workbench.control.planned_law import planned_law
from workbench.control.shell import around

PERIOD = 1e-3
JACK = {
    "velocity_gain": 7.4, "jack_frequency": 31.6, "jack_damping": 0.357, "valve_frequency": 93.8,
    "valve_damping": 0.545, "delay": 0.00082, "inertia": 2.14e5, "error": 0.2,
}  # fmt: skip
FREE = {"command_rate": 1e4, "stroke": 10.0, "speed": 100.0, "pressure": 1e8}


def made(**numbers):
    return Mpc(Mpc.Design(**{**JACK, **numbers}), PERIOD)


@cache
def shipped_spec(name):
    """The design of `position_mpc.toml` of that name."""
    config = load_config(Path(__file__).parents[1] / "experiments" / "position_mpc.toml")
    return next(spec for spec in config.controllers if spec.name == name)


def shipped(name):
    return shipped_spec(name).build(PERIOD)


def planned(controller):
    """What a predictive law is made of, whatever is around it."""
    law = controller.graph_law()
    while law.inner is not None:
        law = law.inner
    return law.planned


def ungoverned(controller):
    """The same without a governor."""
    return LawController(_ungoverned(controller.graph_law()))


def _ungoverned(law):
    if law.inner is not None:
        return around(_ungoverned(law.inner), law.shell)
    plan = law.planned
    free = ReferenceGovernor(plan.observer, plan.law.feedback, plan.feedforward, Braking(1e6, 5.0, 30.0))
    return planned_law(replace(plan, governor=free), PERIOD)


def at_state(mpc, state, reference, before):
    """What the kernel finds where the filter's state is given: no signal corrects it."""
    return planned(mpc).kernel(np.concatenate((state, [0.0, before], np.full(len(mpc.measures), np.nan), [reference])))


def drawn_states(mpc, count, seed):
    """States, references and last commands, most of them near a limit."""
    drawn, n = np.random.default_rng(seed), planned(mpc).observer.n
    for _ in range(count):
        state = np.zeros(len(planned(mpc).law.feedback))
        state[:3] = drawn.normal(0, [0.1, 2e-3, 2e-3])
        state[n : n + 2] = drawn.normal(0, [0.02, 1e6])
        yield state, drawn.normal(0, 0.1), drawn.normal(0, 0.05)
