"""Campaigns that our own plant made: a small cylinder, short records, white sensor noise, and a trace of one."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from workbench.base.process_pool import one_blas_thread
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.trace.study import run_trace
from workbench.engine import Engine
from workbench.identify.trace.findings import Trace
from workbench.identify.trace.problem import EstimationProblem, estimation_problem
from workbench.identify.trace.refit import FittedModel, fit_rig
from workbench.identify.trace.tracer import trace
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import find
from workbench.records import Campaign, Record
from workbench.records.record import write_csv
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse, Rig
from workbench.rigs.rig_file import load_rig

SIGMA = {"pa": 2e4, "pb": 2e4, "position": 1e-4, "spool": 2e-6}
PERIOD = 2e-3
LIBRARY = tuple(find(*key) for key in (("jack.friction", "coulomb"), ("load.bias", "weight"), ("sensor.lag", "")))


def rubbing(force: float = 60.0) -> Rig:
    """The small cylinder with Coulomb friction of so many N."""
    number = Number("Fc", force, "N", "N", "made up")
    return replace(load_rig("festo-tp511"), effects=(EffectUse("jack.friction", "coulomb", {"Fc": number}),))


def made(rig: Rig, name: str, command: np.ndarray, seed: int, sigma: dict[str, float] = SIGMA) -> Record:
    """What the rig would record of a command [n], from rest."""
    plant = build(rig)
    t = np.arange(len(command)) * PERIOD
    u = np.zeros((len(t), len(plant.inputs)))
    u[:, plant.input("command")] = command
    x = Engine(plant).run(equilibrium(plant).x, t, u).x
    y, random = plant.observe(x, u), np.random.default_rng(seed)
    seen = {n: y[:, plant.output(n)] + s * random.standard_normal(len(t)) for n, s in sigma.items()}
    return Record(name, t, {"command": u[:, plant.input("command")], **seen})


def commands(seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steps and a triangle to fit, a sum of sines to judge by; none reaches an end stop."""
    t = np.arange(round(seconds / PERIOD)) * PERIOD
    steps = 0.35 * np.sign(np.sin(2 * np.pi * 1.3 * t + 0.1)) * (1 - 0.5 * (t > seconds / 2))
    triangle = 0.4 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * 2.1 * t))
    sines = 0.2 * sum(np.sin(2 * np.pi * f * t + f) for f in (0.9, 2.3, 5.9))
    return steps, triangle, np.asarray(sines)


def campaign(rig: Rig, seconds: float = 2.0, sigma: dict[str, float] = SIGMA, fitted: float | None = None) -> Campaign:
    """Rest, steps, a triangle and, held out, sines; those that are fitted may be of `fitted` seconds instead."""
    played = (*commands(fitted or seconds)[:2], commands(seconds)[2])
    steps, triangle, sines = (
        made(rig, name, command, seed, sigma)
        for seed, (name, command) in enumerate(zip(("steps", "triangle", "sines"), played, strict=True), 1)
    )
    still = made(rig, "still", np.zeros(round(1.0 / PERIOD)), 4, sigma)
    return Campaign(Path("made"), "festo-tp511", (still,), (steps, triangle), (sines,))


def written(of: Campaign, folder: Path, rig: str = "festo-tp511") -> Path:
    """The campaign as a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    roles = {"static": of.static, "train": of.train, "heldout": of.heldout}
    lists = [f"{role} = [{_files(records, folder)}]" for role, records in roles.items()]
    (folder / "campaign.toml").write_text("\n".join([f'rig = "{rig}"', "[records]", *lists]))
    return folder


def _files(records: Sequence[Record], folder: Path) -> str:
    for record in records:
        write_csv(record, folder / f"{record.name}.csv")
    return ", ".join(f'"{record.name}.csv"' for record in records)


@cache
def rubbing_campaign() -> Campaign:
    """A campaign of the cylinder that rubs."""
    return campaign(rubbing())


@cache
def problem() -> EstimationProblem:
    """What a fit of it works on."""
    with one_blas_thread():
        return estimation_problem(rubbing_campaign(), load_rig("festo-tp511"))


@cache
def alone() -> FittedModel:
    """The rig fitted to it, without friction."""
    with one_blas_thread():
        return fit_rig(problem())


@cache
def named() -> Outcome:
    """What a trace makes of it with friction in the library."""
    return run_trace(rubbing_campaign(), load_rig("festo-tp511"), LIBRARY, no_checkpoint, lambda _: None)


@cache
def unknown() -> Outcome:
    """And without."""
    return run_trace(rubbing_campaign(), load_rig("festo-tp511"), LIBRARY[1:], no_checkpoint, lambda _: None)


@cache
def none() -> Outcome:
    """And with friction in the rig file."""
    spring = (find("load.spring", "linear"),)
    return run_trace(rubbing_campaign(), rubbing(), spring, no_checkpoint, lambda _: None)


@cache
def found() -> Trace:
    """The trace itself, with friction alone in the library."""
    with one_blas_thread():
        return trace(problem(), LIBRARY[:1], no_checkpoint, lambda _: None)
