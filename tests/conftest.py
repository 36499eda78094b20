"""What many tests share: the 10 t rig, its plants and engines, its operating points. Built once a session."""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line has it: before numpy is loaded
os.environ["JACKBENCH_TRUSTED"] = "*"  # what tests write may run; test_trust.py takes it back

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import settings
from made_tasks import write_task
from page_faults import raised

from workbench.commands.common import drawing
from workbench.commands.residual import study as residual
from workbench.engine import Engine
from workbench.identify.columns import polarity
from workbench.identify.fit.impossible import check_ranges
from workbench.identify.trace import problem
from workbench.linear import equilibrium
from workbench.plant import build, build_pilot_bench, build_valve_bench
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

# every interpreter that tests start would compile the package anew
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "30"))  # of each property
settings.register_profile("jackbench", deadline=None, max_examples=EXAMPLES)  # a busy machine is no failure
settings.load_profile("jackbench")

drawing.fault_words = raised


@pytest.fixture(scope="session")
def rig():
    return load_rig("jack-10t")


@pytest.fixture(scope="session")
def plant(rig):
    return build(rig)


@pytest.fixture(scope="session")
def engine(plant):
    return Engine(plant)


@pytest.fixture(scope="session")
def rest(plant):
    """At rest at mid stroke, at null."""
    return equilibrium(plant)


@pytest.fixture(scope="session")
def moving(plant):
    """Moving at 0.1 m/s, outside the lap's doubled gain."""
    return equilibrium(plant, speed=0.1)


@pytest.fixture(scope="session")
def valve_bench(rig):
    return build_valve_bench(rig)


@pytest.fixture(scope="session")
def pilot_bench(rig):
    return build_pilot_bench(rig)


@pytest.fixture(scope="session")
def commanded(plant):
    """Inputs [k, m] of the plant from a command [k], the others zero."""

    def inputs(command):
        u = np.zeros((len(command), len(plant.inputs)))
        u[:, 0] = command
        return u

    return inputs


@pytest.fixture(scope="session")
def with_corrector():
    """A rig with another spool loop, with the numbers of the one that shows the maker's resonance."""
    numbers = {"Ti": 12.1e-3, "Td": 0.633e-3, "tf": 0.548e-3}

    def changed(rig, corrector):
        specs = rig.valve_kind.correctors[corrector]
        added = {name: Number(name, numbers[name], spec.unit, spec.unit, "") for name, spec in specs.items()}
        return replace(rig, corrector=corrector, numbers={**rig.numbers, **added})

    return changed


@pytest.fixture(scope="session")
def with_effect(rig):
    """The 10 t rig with an effect, its numbers as name=(value, unit)."""

    def changed(name, formula="", **numbers):
        given = {key: Number(key, value, unit, unit, "") for key, (value, unit) in numbers.items()}
        return replace(rig, effects=(EffectUse(name, formula, given),))

    return changed


@pytest.fixture
def right_columns(monkeypatch):
    """Fits and imports take columns in the rig's ranges for what they are called, which is half of a short one:
    test_mistaken.py has those that are not, and sound ones that are not refused."""
    for module in (problem, residual):
        monkeypatch.setattr(module, "check_columns", lambda *_: None)
    monkeypatch.setattr(polarity, "found_mistake", lambda campaign, rig, _: check_ranges(campaign, rig))


@pytest.fixture
def written(tmp_path):
    """A bundled task of the environments with some tables or values replaced (None: left out), as a file."""
    return partial(write_task, tmp_path)
