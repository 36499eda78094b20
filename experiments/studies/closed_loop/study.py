"""Drawn rigs in the loops of their makers: reference and position are recorded, and a rig of the label alone is fitted.

What the label does not say, oil, friction, mass, volumes, lap and valve, differs between the rig that is played and
the one that is fitted.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from workbench.commands.common.outcome import Outcome, Progress, Stage, no_checkpoint
from workbench.commands.fit.study import fit_campaign
from workbench.commands.new.closed_loop import closed_loop_rig
from workbench.identify.fit.model import Model
from workbench.identify.found.channels import longer_without
from workbench.identify.trace.problem import estimation_problem
from workbench.identify.trace.refit import fit_rig
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import Effect
from workbench.records import Campaign, Record
from workbench.records.excitation import multisine
from workbench.report import Curve, Figure, Page, Panel, Section, Table
from workbench.report.figures import Mark
from workbench.rigs.driven import driven
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig

_SPREAD = {"beta": 0.3, "M": 0.3, "b": 0.6, "V0": 0.5, "eps": 0.5, "f0": 0.4, "zeta": 0.3}
"""How far the played rig is from the rule of thumb, as a share either way."""
_SECONDS, _NOISE = 6.0, 1e-4  # of each record; of the motion: noise of the position sensor
_NAMES = ("loop_gain", "loop_delay", "z0")
_PRESSURES, _PRESSURE_NOISE = ("pa", "pb"), 1e-4  # of the supply
_WITHOUT = ("without_pa", "without_both")


def run_closed_loop(number: int, seed: int, stage: Stage, progress: Progress) -> Outcome:
    """`rows`: of each drawn loop its three numbers, the interval of each, and whether it holds the truth; `missing`:
    how many times as long the interval of each of its rig's numbers is without one pressure, and without both."""
    rows: list[dict[str, Any]] = []
    missing: list[dict[str, Any]] = []
    for k in range(number):
        progress(f"loop {k + 1} of {number}")
        rows += stage(f"loop {k}", lambda own=k: _fitted(own, seed))
        missing += stage(f"pressures {k}", lambda own=k: _missing(own, seed))
    return Outcome({"rows": rows, "missing": missing}, lambda: _page(rows, missing))


def drawn_loop(number: int, seed: int) -> tuple[Rig, Rig]:
    """The rig that the label says, and the true one."""
    random = np.random.default_rng((seed, number))
    label = {
        "force": float(10 ** random.uniform(4, 5.7)),
        "stroke": float(10 ** random.uniform(-1.3, -0.3)),
        "speed": float(random.uniform(0.2, 1.0)),
    }
    label["M"] = float(label["force"] / 9.81 * 10 ** random.uniform(-2, -1))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "rig.toml"
        file.write_text(closed_loop_rig(label, f"loop-{number}"), encoding="utf-8")
        rig = load_rig(file)
    mode = math.sqrt(4 * rig["beta"] * rig["Aj"] ** 2 / ((rig["Aj"] * rig["S"] + 2 * rig["V0"]) * rig["M"]))
    most = min(40.0, 0.03 * mode)  # 1/s: a third of what the oil's damping of 5 % bears
    speed_gain = float(random.uniform(min(5.0, most / 2), most))
    true = {
        **{name: rig[name] * (1 + share * float(random.uniform(-1, 1))) for name, share in _SPREAD.items()},
        "loop_gain": speed_gain / label["speed"],
        "loop_delay": float(random.uniform(0.5e-3, 15e-3)),
        "z0": float(random.uniform(-0.01, 0.01)),
    }
    return rig, rig.with_values(**true)


def _fitted(number: int, seed: int) -> list[dict[str, Any]]:
    rig, true = drawn_loop(number, seed)
    records = [
        played(true, np.random.default_rng((seed, number, k)), name) for k, name in enumerate(("train", "heldout"))
    ]
    campaign = Campaign(Path(), rig.name, (), (records[0],), (records[1],))
    metrics = fit_campaign(driven(campaign, rig), rig, 1, no_checkpoint, lambda _: None).outcome.metrics
    rows = []
    for name in _NAMES:
        value, low, high = metrics["parameters"][f"{name} [{rig.numbers[name].si}]"]
        truth = true[name]
        rows.append({
            "loop": number, "number": name, "truth": truth, "value": value, "low": low, "high": high,
            "held": bool(low <= truth <= high), "chi2": metrics["chi2"]["heldout"],
        })  # fmt: skip
    return rows


def _missing(number: int, seed: int) -> list[dict[str, Any]]:
    rig, true = drawn_loop(number, seed)
    random = np.random.default_rng((seed, number))
    records = [played(true, random, name, _PRESSURES) for name in ("train", "heldout")]
    problem = estimation_problem(driven(Campaign(Path(), rig.name, (), (records[0],), (records[1],)), rig), rig)
    found = fit_rig(problem)
    one, both = longer_without(problem, found, [_PRESSURES[:1], _PRESSURES])
    return [
        {"loop": number, "number": free.name, "without_pa": float(a), "without_both": float(b)}
        for free, a, b in zip(found.fit.free, one, both, strict=True)
    ]


def played(
    rig: Rig,
    random: np.random.Generator,
    name: str,
    beside: Sequence[str] = (),
    lacking: Sequence[tuple[Effect, Mapping[str, float]]] = (),
) -> Record:
    """A multisine and steps of the reference, as the loop follows them, with pressures `beside`; the rig has effects
    that nobody declared, `lacking`, with numbers."""
    assert rig.inner is not None
    period = rig.period.value
    size, t = 0.02 * rig.inner.full_command, np.arange(0, _SECONDS, period)
    wave = np.roll(multisine(1.0, _SECONDS, period, (0.3, 15.0)), int(random.integers(t.size)))[: t.size]
    wave *= np.tanh(10 * t)  # from rest
    steps = np.repeat(random.uniform(-1, 1, math.ceil(t.size * period / 0.5)), round(0.5 / period))[: t.size]
    reference = size * (wave / np.abs(wave).max() + 0.5 * steps)
    plant = build(rig, also=[effect for effect, _ in lacking])
    given = {effect.key(key): value for effect, numbers in lacking for key, value in numbers.items()}
    p = plant.parameter_values(None, **given)
    asked = Record(name, t, {"command": reference / rig.inner.full_command})
    names = ("position", *beside)
    came = Model(plant, names).run_through(asked, equilibrium(plant, p=p).x, p)
    sizes = [_NOISE * size / 0.02, *(_PRESSURE_NOISE * rig["Ps"] for _ in beside)]
    noisy = came + np.array(sizes) * random.standard_normal(came.shape)
    return Record(name, t, {"reference": reference, **dict(zip(names, noisy.T, strict=True))})


def _page(rows: list[dict[str, Any]], missing: list[dict[str, Any]]) -> tuple[Page, Figure]:
    loops = len({row["loop"] for row in rows})
    cells = []
    for name in _NAMES:
        own = [row for row in rows if row["number"] == name]
        half = float(np.median([(row["high"] - row["low"]) / 2 / max(abs(row["truth"]), 1e-12) for row in own]))
        cells.append([name, len(own), sum(row["held"] for row in own), 100 * half])
    curves = [
        Curve(
            name,
            np.arange(loops, dtype=float),
            np.array([_off(row) for row in rows if row["number"] == name]),
            "markers",
        )
        for name in _NAMES
    ]
    figure = Figure(
        "Value less truth, over half of the interval",
        "loop",
        [Panel("off [1]", curves, marks=(Mark(-1.0), Mark(1.0)))],
    )
    table = Table("Intervals of 95 % that hold the truth", ["number", "loops", "held", "typical half [%]"], cells)
    costs = [
        [name, *(float(np.median([row[key] for row in missing if row["number"] == name])) for key in _WITHOUT)]
        for name in dict.fromkeys(row["number"] for row in missing)
    ]
    head = ["number", "without one pressure", "without both"]
    without = Table("Times as long as with position and both pressures, median", head, costs)
    held = sum(row["held"] for row in rows)
    said = f"{held} of {len(rows)} intervals of 95 % hold the truth, over {loops} loops whose valve nobody recorded."
    return Page(
        "Numbers of hidden loops",
        said,
        [Section("Intervals", [figure, table]), Section("What a channel costs", [without])],
    ), figure


def _off(row: dict[str, Any]) -> float:
    return (row["value"] - row["truth"]) / max((row["high"] - row["low"]) / 2, 1e-300)
