"""The commands around a design: the jack as a controller sees it, a search, coefficients for a rig's controller."""

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from .bench_config import BenchConfig, load_bench
from .coefficients import as_json, as_text, coefficients
from .command import computes, finish, jobs, prints, works
from .compensator import Compensator
from .config import StepConfig, load_config
from .errors import InputError
from .fractional import JackModel, damped, fit_jack_model, overshoot_spread, spread
from .plant import build
from .rig import rig_table
from .studies.timing import run_timing
from .studies.tune import run_tune
from .toml import read_toml
from .tune_config import load_tune
from .views import equilibrium

MOVING = 0.1  # m/s


def add(commands: Any) -> None:
    """Commands that say what a design starts from, search it, and print what it ends in."""
    seen = commands.add_parser(
        "jack-model",
        help="the jack in six numbers, as CRONE and LQG take it",
        description="Six numbers of the jack with the compensators of an experiment's controllers closed.",
    )
    written = commands.add_parser(
        "coefficients",
        help="second-order sections and a test vector, for a rig's own digital controller",
        description="Discrete coefficients of an experiment's controllers at the rig's period.",
    )
    varied = commands.add_parser(
        "spread",
        help="how the overshoot spreads over gain, speed, mass, oil and specimen",
        description="Overshoot of linear position steps, one number of loop or rig varied at a time.",
    )
    tuned = commands.add_parser(
        "tune",
        help="search a controller's numbers: hard goals over a set of rigs, then the least cost",
        description="Search the numbers of a controller, and leave tuned.toml, an experiment of the best.",
    )
    tuned.add_argument("experiment", help="such as experiments/tune_p_dp.toml")
    works(tuned)
    computes(tuned, _tune)
    timed = commands.add_parser(
        "time",
        help="how long controllers compute, and an experiment that knows it",
        description="Time the controllers of an experiment, and leave timed.toml with their computing delays.",
    )
    timed.add_argument("experiment", help="such as experiments/benchmark.toml")
    computes(timed, _time)
    for command, call in ((seen, _jack_model), (written, _coefficients), (varied, _spread)):
        command.add_argument("experiment", help="such as experiments/position_crone.toml")
        command.add_argument("--rig", help="a bundled rig or a rig file, instead of the one that is named")
        command.add_argument("--controller", metavar="NAME", help="only this one")
        prints(command, call)


def _tune(options: argparse.Namespace, words: list[str]) -> None:
    config = load_tune(options.experiment, options.rig)
    identity = {"command": "tune", "experiment": config.source, "rig": rig_table(config.start.rig)}
    finish(options, words, Path(options.experiment).stem, identity, partial(run_tune, config, jobs=jobs(options)))


def _time(options: argparse.Namespace, words: list[str]) -> None:
    path = Path(options.experiment)
    load = load_bench if read_toml(path).get("experiment") == "bench" else load_config
    config = load(path, options.rig)
    if not isinstance(config, StepConfig | BenchConfig):
        raise InputError(f"{path}: has no controllers")
    identity = {"command": "time", "experiment": config.source, "rig": rig_table(config.rig)}
    study = partial(run_timing, config, options.rig or config.source["rig"])
    finish(options, words, f"time-{path.stem}", identity, study)


def _read(options: argparse.Namespace) -> StepConfig:
    """The experiment, with the wanted controllers only."""
    config = load_config(options.experiment, options.rig)
    if not isinstance(config, StepConfig):
        raise InputError(f"{options.experiment}: has no controllers")
    names = [chosen.name for chosen in config.controllers]
    if options.controller not in (None, *names):
        raise InputError(f"{options.experiment}: no controller {options.controller}; it has {', '.join(names)}")
    chosen = tuple(one for one in config.controllers if options.controller in (None, one.name))
    return replace(config, controllers=chosen)


def _jack_model(options: argparse.Namespace, _words: list[str]) -> None:
    config = _read(options)
    plant, period = build(config.rig), config.rig.period.value
    smooth = plant.without_dry_friction()
    points = {"null": equilibrium(plant, p=smooth), "moving": equilibrium(plant, speed=MOVING, p=smooth)}
    found: dict[str, dict[str, dict[str, float]]] = {}
    for chosen in config.controllers:
        parts = [cast(Compensator, part.make(period)) for part in chosen.compensators]
        found[chosen.name] = {
            where: asdict(fit_jack_model(damped(plant, about, period, parts, smooth)))
            for where, about in points.items()
        }
    units = {entry.name: entry.metadata["unit"] for entry in fields(JackModel)}

    def told(name: str) -> str:
        return "\n".join(
            f"# {name}, {where}\n"
            + "\n".join(f'{key} = {{value = {value:.5g}, unit = "{units[key]}"}}' for key, value in numbers.items())
            for where, numbers in found[name].items()
        )

    _print(options, found, told)


def _coefficients(options: argparse.Namespace, _words: list[str]) -> None:
    config = _read(options)
    period = config.rig.period.value
    found = {chosen.name: coefficients(chosen.make(period), period) for chosen in config.controllers}
    _print(options, {name: as_json(one) for name, one in found.items()}, lambda name: as_text(name, found[name]))


def _spread(options: argparse.Namespace, _words: list[str]) -> None:
    config = _read(options)
    period = config.rig.period.value
    able = [one for one in config.controllers if replace(one, compensators=()).make(period).measures == ("position",)]
    chosen = able or config.controllers  # where there is none, the first says why
    if left := [one.name for one in config.controllers if one not in chosen]:
        print(f"left out: {', '.join(left)}; a spread is of position laws", file=sys.stderr)
    found = {one.name: overshoot_spread(config.rig, one) for one in chosen}

    def told(name: str) -> str:
        lines = [f"{name}: overshoot [%] of a linear step"]
        for what, overshoot in found[name].items():
            row = "  ".join(f"{how}: {_percent(value)}" for how, value in overshoot.items())
            lines.append(f"  {what:6s} spread {_percent(spread(overshoot)):>8s}   {row}")
        return "\n".join(lines)

    _print(options, found, told)


def _print(options: argparse.Namespace, found: Mapping[str, Any], told: Callable[[str], str]) -> None:
    """What was found of each controller, as JSON or as it is told to people."""
    print(json.dumps(found, indent=2) if options.json else "\n\n".join(told(name) for name in found))


def _percent(value: float | None) -> str:
    return "unstable" if value is None else f"{value:.1f}"
