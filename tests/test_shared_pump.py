"""Two functions on one pump: what the other one draws is missing here, as its recorded position says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import PERIOD, commands

from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.fit.study import fit_campaign
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Campaign, Record
from workbench.rigs.driven import driven
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse, Rig
from workbench.rigs.rig_file import load_rig, save_rig

AA, AB, SHARE, NOISE = 1.2e-4, 8e-5, 0.25, 2e-5


def sharing(share: float = SHARE, declared: bool = True) -> Rig:
    """The small cylinder on a pump that ends, which another function draws from, too."""
    rig = load_rig("festo-tp511")
    numbers = {
        "share": Number("share", share, "1", "1", "made up", low=0.02, high=0.6),
        "tau": Number("tau", 0.02, "s", "s", "made up"),
    }
    rig = replace(rig, effects=(EffectUse("supply.limit", "flow", numbers),))
    areas = {"other_AA": AA, "other_AB": AB} if declared else {}
    return replace(rig, numbers=rig.numbers | {name: Number(name, a, "m^2", "m^2", "") for name, a in areas.items()})


def played(rig: Rig, name: str, command: np.ndarray, seed: int) -> Record:
    """Command and both positions, with noise, while the other function goes to and fro."""
    random, plant = np.random.default_rng(seed), build(rig)
    t = np.arange(command.size) * PERIOD
    speed = 0.1 * np.sin(2 * np.pi * (0.4 + 0.1 * seed) * t)
    u = np.zeros((t.size, len(plant.inputs)))
    u[:, plant.input("command")], u[:, plant.input("other_velocity")] = command, speed
    y = plant.observe(Engine(plant).run(equilibrium(plant).x, t, u).x, u)
    signals = {"position": y[:, plant.output("position")], "other_position": PERIOD * np.cumsum(speed)}
    signals = {key: values + NOISE * random.standard_normal(t.size) for key, values in signals.items()}
    return Record(name, t, {"command": command, **signals})


@pytest.mark.parametrize(("other", "area"), [(0.1, AA), (-0.1, AB)])
def test_what_the_other_function_draws_is_missing_here(other, area):
    """At a command beyond the pump's flow, whichever way the other one goes."""
    rig = sharing()
    plant, t = build(rig), np.arange(0, 0.4, PERIOD)
    speeds = []
    for velocity in (0.0, other):
        u = np.zeros((t.size, len(plant.inputs)))
        u[:, plant.input("command")], u[:, plant.input("other_velocity")] = 0.9, velocity
        x = Engine(plant).run(equilibrium(plant, position=-0.05).x, t, u).x
        speeds.append(plant.observe(x, u)[-1, plant.output("velocity")])
    missing = rig["AA"] * (speeds[0] - speeds[1])
    assert missing == pytest.approx(abs(other) * area, rel=0.1)  # the pressure, too, is another one


def test_a_fit_finds_the_pump_only_with_what_the_other_function_draws():
    rig = sharing()
    records = [played(rig, name, c, k) for k, (name, c) in enumerate(zip("abc", commands(2.0), strict=True), 1)]
    campaign = Campaign(Path(), rig.name, (), tuple(records[:2]), tuple(records[2:]))
    errors = {}
    for declared in (True, False):
        described = sharing(0.4, declared)
        found = fit_campaign(driven(campaign, described), described, 1, no_checkpoint, lambda _: None).outcome.metrics
        errors[declared] = found["chi2"]["heldout"]
        if declared:
            share, k3 = (found["parameters"][name][0] for name in ("supply.limit.share [1]", "K3 [m^2/s/Pa^0.5]"))
            assert share * k3 == pytest.approx(SHARE * rig["K3"], rel=0.01)  # the largest flow of the pump
    assert errors[True] < 1.2
    assert errors[False] > 100 * errors[True]


def test_areas_come_as_a_pair_and_the_other_position_is_asked_for(tmp_path):
    rig = sharing()
    save_rig(rig, tmp_path / "rig.toml")
    assert load_rig(tmp_path / "rig.toml")["other_AB"] == AB
    text = (tmp_path / "rig.toml").read_text()
    (tmp_path / "half.toml").write_text("\n".join(line for line in text.splitlines() if "other_AB" not in line))
    with pytest.raises(InputError, match=r"other_AA.*needs other_AB beside it; give both, or neither"):
        load_rig(tmp_path / "half.toml")
    record = played(rig, "a", commands(0.5)[0], 1)
    alone = replace(record, signals={k: v for k, v in record.signals.items() if k != "other_position"})
    with pytest.raises(InputError, match="record a: no other_position"):
        driven(Campaign(Path(), rig.name, (), (alone,), ()), rig)


def test_the_other_velocity_is_the_slope_of_its_position_on_any_clock():
    rig, random = sharing(), np.random.default_rng(3)
    t = np.cumsum(random.uniform(0.02, 0.05, 600))
    position = 0.1 * np.sin(2 * t)
    record = Record("a", t, {"command": 0 * t, "other_position": position})
    (came,) = driven(Campaign(Path(), rig.name, (), (record,), ()), rig).train
    assert came.signals["other_velocity"][2:-2] == pytest.approx(0.2 * np.cos(2 * t[2:-2]), abs=1e-3)
