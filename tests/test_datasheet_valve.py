"""Effects of valves known by their datasheets, on campaigns of an independent generator that recorded no spool."""

from dataclasses import replace
from pathlib import Path

import pytest

import workbench as wb
from workbench.plant.effects import find
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

BENCH = Path(__file__).parents[2] / "shared" / "bench"
CASES = {  # what the generator did: play of 2 % of full command, and full sines up to 6 Hz
    "hystns": ("pilot.hysteresis", "magnet play", "r", 0.02, 0.015),
    "rate": ("main.rate", "symmetric", "T", 1 / (2 * 3.141592653589793 * 6.0), 0.03),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.skipif(not BENCH.exists(), reason="needs ../shared/bench")
def test_the_effect_s_own_formula_leaves_the_noise_alone_and_finds_its_number(name):
    effect, formula, number, truth, start = CASES[name]
    spec = {n.name: n for n in find(effect, formula).numbers}[number]
    given = Number(number, start, spec.si, spec.si, "a guess", low=spec.low, high=spec.high)
    rig = replace(load_rig(BENCH / name / "bench.toml"), effects=(EffectUse(effect, formula, {number: given}),))
    answer = wb.fit(BENCH / name, rig, starts=1)
    assert answer.chi2["heldout"] < 1.05
    assert answer.parameters[f"{effect}.{number} [{spec.si}]"][0] == pytest.approx(truth, rel=0.005)
