"""Bounds of numbers of rigs, effects, platforms and controllers are finite, and a rig at each runs or is refused."""

from math import isfinite

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.base.signals import PLATFORM, SIGNALS
from workbench.base.units import Spec, to_si
from workbench.commands.list.catalogue import listing
from workbench.engine import Engine
from workbench.engine.engine import ATTEMPTS, BURST, RATE
from workbench.linear import equilibrium
from workbench.linear.platform_modes import platform_equilibrium
from workbench.plant import build, build_platform
from workbench.plant.effects import LIBRARY, PUMP_LIBRARY
from workbench.rigs import schema
from workbench.rigs.jack import JACKS
from workbench.rigs.line_valve import LINE_VALVES
from workbench.rigs.load import LOADS
from workbench.rigs.platform import load_platform, platform
from workbench.rigs.platform.effects import EFFECTS
from workbench.rigs.rig_file import bundled, load_rig
from workbench.rigs.sensor import sensor_specs
from workbench.rigs.valve import VALVES

SECONDS = 0.1  # of a run at a bound


def of_rigs():
    tables = [schema.SUPPLY, schema.OIL, schema.LOAD, schema.LIMITS, schema.CONTROL, schema.SHUT_OFF, *LOADS.values()]
    tables += LINE_VALVES.values()
    tables += [kind.numbers for kind in JACKS.values()]
    for kind in VALVES.values():
        tables += [kind.numbers, *kind.correctors.values()]
    tables += [platform.PAYLOAD, platform.PLACE, platform.LEG, platform.JOINTS, *EFFECTS.values()]
    tables += [sensor_specs(signal) for signal in (*SIGNALS.values(), *PLATFORM.values())]
    for table in tables:
        yield from table.items()


def of_effects():
    for effect in (*LIBRARY, *PUMP_LIBRARY):
        for each in effect.numbers:
            yield f"{effect.name} {each.name}", Spec(each.si, each.low, each.high, each.meaning)
            assert each.low <= each.typical <= each.high


def of_controllers():
    for row in listing("controllers"):
        for each in row["numbers"]:
            if each["low"] is not None:  # else it is a file
                spec = Spec(each["unit"], each["low"], each["high"], each["meaning"])
                yield f"{row['name']} {each['name']}", spec


@pytest.mark.parametrize("kind", [of_rigs, of_effects, of_controllers])
def test_every_number_has_finite_bounds_in_a_known_unit_and_a_meaning(kind):
    specs = list(kind())
    assert len(specs) > 100
    for name, spec in specs:
        assert isfinite(spec.low), name
        assert isfinite(spec.high), name
        assert spec.low < spec.high, name
        assert to_si(1.0, spec.unit, spec.unit) == 1.0, name
        assert spec.meaning, name


def ends(specs):
    for name, spec in specs.items():
        yield from ((name, end) for end in (spec.low, spec.high))


def played(plant, x, u, period, p):
    """Runs of `SECONDS` with a tenth of the command on plants with parameters p [lanes, k]: which of them failed."""
    k = round(SECONDS / period)
    inputs = np.tile(u, (k, 1))
    inputs[:, 0] += 0.1
    batch = Engine(plant, brief=True).run_batch(np.tile(x, (len(p), 1)), period * np.arange(k + 1), inputs, np.array(p))
    assert np.isfinite(batch.x[batch.failed < 0]).all()
    assert batch.attempts.max() <= RATE * SECONDS + BURST + ATTEMPTS  # so that it ends in a second
    return batch.failed >= 0


@pytest.mark.parametrize("name", [name for name in bundled() if name != "jack-10t-rounded"])
def test_a_rig_at_each_bound_runs_or_is_refused_in_a_line(name):
    rig, built, refused = load_rig(name), [], []
    for number, value in ends({each: rig.specs[each] for each in rig.numbers}):
        try:
            built.append(build(rig.with_values(**{number: value})).p)
        except InputError as error:
            refused.append(str(error))
    assert all(words.startswith(f"rig {name}: ") and "\n" not in words for words in refused)
    plant = build(rig)
    rest = equilibrium(plant)
    assert np.mean(played(plant, rest.x, rest.u, rig.period.value, built)) < 0.1


def test_a_platform_at_each_bound_runs_or_is_refused_in_a_line():
    whole = load_platform("hexapod")
    plant = build_platform(whole)
    rest = platform_equilibrium(plant)
    built = [
        build_platform(whole.with_values(**{number: value})).p
        for number, value in ends({**platform.PAYLOAD, **platform.PLACE, **platform.LEG, **platform.JOINTS})
    ]
    assert not played(plant, rest.x, rest.u, whole.period, built).any()
