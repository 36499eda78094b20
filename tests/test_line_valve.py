"""A valve in the line of a jack: what opens it, what it holds and lets sink, and that no oil or energy is lost."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from made_campaigns import campaign
from scipy.optimize import brentq

import workbench as wb
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.fit.study import run_fit
from workbench.engine import Engine
from workbench.linear import equilibrium, linearise
from workbench.linear.platform_modes import platform_equilibrium
from workbench.loop.guard_numbers import guard_shape
from workbench.loop.run_numbers import supply_energy
from workbench.plant import build, build_force_port, build_platform
from workbench.plant.effects import LIBRARY, applies
from workbench.plant.valve.supply import supply_power
from workbench.rigs.line_valve import CHECK, COUNTERBALANCE, LINE_VALVES, SIDES, LineValve
from workbench.rigs.number import Number
from workbench.rigs.platform import load_platform
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig, save_rig

ATM = 101300.0
FREE = {
    "line_volume": 2e-4,
    "line_cracking": 1e5,
    "line_lift": 2e5,
    "line_flow": 2.4e-5,
    "line_ratio": 3.0,
}
OPENED = {"line_setting": 150e5, "line_span": 50e5, "line_return": 1e-5, "line_back_ratio": 4.0}
OF_FESTO = {"line_volume": 1e-5, "line_flow": 4e-7, "line_setting": 25e5, "line_span": 20e5, "line_return": 3e-7}


def with_valve(name: str, kind: str, side: str = "A", **values: float) -> Rig:
    """A bundled rig, or a rig file, with a line valve."""
    rig, values = load_rig(name), {**FREE, **OPENED, **values}
    own = {key: Number(key, values[key], s.unit, s.unit, "made up") for key, s in LINE_VALVES[kind].items()}
    return replace(rig, line_valve=LineValve(kind, side), numbers={**rig.numbers, **own})


def tight(kind: str, **values: float) -> Rig:
    """The jack of 10 t with one in line A, and no leakage past its piston."""
    return with_valve("jack-10t", kind, **values).with_values(Cl=0.0)


@cache
def engine(kind: str | None, side: str = "A") -> Engine:
    rig = with_valve("jack-10t", kind, side) if kind else load_rig("jack-10t")
    return Engine(build(rig))


def flow_of(rig: Rig) -> Callable[[float, float, float], float]:
    """Flow into chamber A [m^3/s] by its rate, at pressures [Pa] of it, of its line and of the other one."""
    plant, volume = build(rig), rig["V0"] + rig["Aj"] * rig["S"] / 2

    def flow(chamber: float, line: float, pilot: float) -> float:
        x = plant.start
        for name, value in (("P1", chamber), ("PLA", line), ("P2", pilot), ("x", 0.0)):
            x[plant.state(name)] = value
        rates = np.array(plant.f(x, np.zeros(len(plant.inputs)), plant.p)).ravel()
        return float(rates[plant.state("P1")] * volume / rig["beta"])

    return flow


def root(drop: np.ndarray | float) -> np.ndarray | float:
    return drop / (drop * drop + 1e6) ** 0.25


def share(way: np.ndarray | float) -> np.ndarray | float:
    """Opening: the mean of a valve that opens linearly, over 5 % of the way on both sides."""
    about = np.linspace(-0.05, 0.05, 2001)
    return np.trapezoid(np.clip(np.add.outer(np.asarray(way, float), about), 0.0, 1.0), about, axis=-1) / 0.1


def opens_at(law: Callable[[float], float], low: float, high: float) -> float:
    """Where the line through a quarter and three quarters of the opening meets zero, which the law [1] grows along."""
    quarter, most = (brentq(lambda at, part=part: law(at) - part, low, high, xtol=1e-3) for part in (0.25, 0.75))
    return quarter - (most - quarter) / 2


@pytest.mark.parametrize(("ratio", "back"), [(3.0, 4.0), (8.0, 9.0), (3.0, 0.0)])
@pytest.mark.parametrize(("line", "pilot"), [(5e5, 5e5), (20e5, 30e5), (5e5, 15e5)])
def test_a_counterbalance_valve_opens_at_the_pressure_of_its_datasheet(ratio, back, line, pilot):
    """Setting less ratio times pilot plus the back pressure at its ratio, gauge; without pilot and back its setting."""
    rig = tight(COUNTERBALANCE, line_ratio=ratio, line_back_ratio=back)
    flow = flow_of(rig)

    def opening(chamber: float) -> float:
        return -flow(chamber, line, pilot) / (rig["line_return"] * float(root(chamber - line)))

    # Sun Hydraulics: pilot pressure = (setting - load)/ratio; back pressure adds at 1 + ratio where it is not vented
    expected = rig["line_setting"] - ratio * (pilot - ATM) + back * (line - ATM)
    assert opens_at(opening, 1e4 + line, 9e7) == pytest.approx(expected + ATM, rel=1e-6)
    full = expected + ATM + rig["line_span"]
    assert opening(full + 0.1 * rig["line_span"]) == pytest.approx(1.0, rel=1e-9)
    assert opening(expected + ATM - 0.1 * rig["line_span"]) == 0.0


@pytest.mark.parametrize("ratio", [1.5, 3.0, 10.0])
def test_a_check_valve_is_lifted_by_the_pilot_over_the_pressure_that_shuts_it_by_its_ratio(ratio):
    """(pc - pl + p0)/r above the line, at which area times pilot balances load and spring."""
    rig, chamber, line = tight(CHECK, line_ratio=ratio), 120e5, 10e5
    flow = flow_of(rig)

    def opening(pilot: float) -> float:
        return -flow(chamber, line, pilot) / (rig["line_flow"] * float(root(chamber - line)))

    expected = line + (chamber - line + rig["line_cracking"]) / ratio
    assert opens_at(opening, line, 5e7) == pytest.approx(expected, rel=1e-6)
    assert opening(0.99 * expected) == 0.0
    assert opening(1.1 * expected) == pytest.approx(1.0)
    assert opening(0.0) == 0.0  # a pilot piston pushes only


@pytest.mark.parametrize("kind", [CHECK, COUNTERBALANCE])
def test_free_flow_costs_the_drop_of_the_check_alone(kind):
    """Extending steadily: Q = A v + leak passes at the drop d where K o((d - p0)/lift) root(d) = Q."""
    rig, plant = with_valve("jack-10t", kind), engine(kind).plant
    for speed in (0.05, 0.5, 3.0):
        point = equilibrium(plant, speed=speed)
        y = dict(zip(plant.outputs, plant.observe(point.x, point.u)[0], strict=True))
        asked = rig["Aj"] * speed + rig["Cl"] * (y["pa"] - y["pb"])

        def beyond(drop: float, asked: float = asked) -> float:
            return (
                rig["line_flow"] * float(share((drop - rig["line_cracking"]) / rig["line_lift"]) * root(drop)) - asked
            )

        assert y["line_pa"] - y["pa"] == pytest.approx(brentq(beyond, 1.0, 1e8), rel=1e-4)


@pytest.mark.parametrize("kind", [CHECK, COUNTERBALANCE])
def test_flow_only_loses_energy_and_none_passes_a_shut_valve(kind):
    """Q (pl - pc) is never negative; a chamber above its line keeps its oil exactly where no pilot lifts."""
    flow, random = flow_of(tight(kind)), np.random.default_rng(1)
    for chamber, line, pilot in random.uniform(2e5, 300e5, (200, 3)):
        assert flow(chamber, line, pilot) * (line - chamber) >= 0
        if pilot <= line < chamber and chamber - line < OPENED["line_setting"] - OPENED["line_span"]:
            assert flow(chamber, line, pilot) == 0.0


# --- a jack that carries


def played(kind: str | None, rig: Rig, command: np.ndarray, load: float, position: float = 0.0, step: float = 1e-4):
    """What the jack does of a command [k] at a `step` [s] with a load [N] on it, from where the load is carried by its
    pressures, half the supply behind the piston."""
    own, k = engine(kind), len(command)
    plant = own.plant
    t, u = step * np.arange(k), np.zeros((k, len(plant.inputs)))
    u[:, plant.input("command")], u[:, plant.input("disturbance")] = command, load
    x = plant.start
    x[plant.state("x")] = position
    half = 0.5 * (rig["Ps"] + rig["Pr"])
    x[plant.state("P2")], x[plant.state("P1")] = half, half + load / rig["Aj"]
    for name in ("PLA", "PLB"):
        if name in [state.name for state in plant.states]:
            x[plant.state(name)] = half
    p = plant.parameter_values(**{name: rig[name] for name in plant.parameters if name in rig.numbers})
    run = own.run(x, t, u, p)
    assert run.ok
    signals = dict(zip(plant.outputs, plant.observe(run.x, u, p).T, strict=True))
    return SimpleNamespace(t=t, signals=signals, plant=plant, x=run.x, p=p)


LOAD = 4e4  # N: 86 bar on the piston


@pytest.mark.parametrize("kind", [CHECK, COUNTERBALANCE])
def test_a_shut_valve_holds_a_weight_that_without_it_sinks_by_the_leakage_of_the_lands(kind):
    rig, free = tight(kind), load_rig("jack-10t").with_values(Cl=0.0)
    held, sunk = played(kind, rig, np.zeros(20_001), LOAD), played(None, free, np.zeros(20_001), LOAD)
    plain = build(free)
    sinks = equilibrium(plain, command=0.0, disturbance=LOAD, p=plain.without_dry_friction()).speed
    assert sinks < -5e-3
    t = sunk.t > 1.0
    rate = np.polyfit(sunk.t[t], sunk.signals["position"][t], 1)[0]
    assert rate == pytest.approx(sinks, rel=0.05)
    # of chamber A, no oil is lost: the piston only breathes as the chamber behind it drifts
    volume = rig["V0"] + rig["Aj"] * (rig["S"] / 2 + held.signals["position"])
    oil = volume * np.exp((held.signals["pa"]) / rig["beta"])
    assert np.ptp(oil) < 1e-6 * oil[0]
    assert abs(held.signals["position"][-1]) < 0.02 * abs(sunk.signals["position"][-1])


def test_what_leaks_past_the_piston_sinks_behind_a_shut_valve():
    """A = B and the other line is open: the piston sinks by the leakage over its area."""
    leak = 1e-13
    rig = with_valve("jack-10t", COUNTERBALANCE).with_values(Cl=leak)
    run = played(COUNTERBALANCE, rig, np.zeros(20_001), LOAD)
    late = run.t > 1.0
    rate = np.polyfit(run.t[late], run.signals["position"][late], 1)[0]
    assert rate == pytest.approx(-leak * LOAD / rig["Aj"] ** 2, rel=0.2)


def test_a_load_that_overruns_cavitates_without_the_valve_and_not_with_it():
    """120 kN, 257 bar, are more than the lands hold: the other chamber is sucked empty. Metered by a counterbalance
    valve it is fed at the pressure at which pilot, load and back pressure balance the spring."""
    load, lowering = 1.2e5, -0.05 * np.clip(np.arange(3001) / 1000, 0.0, 1.0)
    rig, free = tight(COUNTERBALANCE, line_setting=330e5), load_rig("jack-10t").with_values(Cl=0.0)
    run, sucked = (
        played(kind, own, lowering, load, position=0.2) for kind, own in ((COUNTERBALANCE, rig), (None, free))
    )
    assert sucked.signals["lowest_pressure"].min() < ATM - 1e3
    assert run.signals["lowest_pressure"].min() > 2 * ATM
    assert run.signals["velocity"][-1] < -0.1
    late = run.t > 0.25
    pa, pb, line = (float(np.mean(run.signals[name][late])) for name in ("pa", "pb", "line_pa"))
    opened = rig["Aj"] * -float(np.mean(run.signals["velocity"][late])) / rig["line_return"] / root(pa - line)
    balanced = (pa - ATM) + 3 * (pb - ATM) - 4 * (line - ATM)
    assert balanced == pytest.approx(rig["line_setting"] + opened * rig["line_span"], rel=0.02)


@pytest.mark.parametrize("kind", [CHECK, COUNTERBALANCE])
def test_oil_and_energy_balance(kind):
    """Of line and chamber A: what the lands let in less what the valve lets through is compressed in the line, and that
    less what the piston sweeps in the chamber; and the supply's work is that of losses, load and what is stored."""
    step = 2e-5
    command = 0.08 * np.sin(2 * np.pi * 4 * step * np.arange(25_001))
    rig = tight(kind, line_setting=150e5)
    run = played(kind, rig, command, LOAD, step=step)
    s, t = run.signals, run.t
    state = {each.name: run.x[:, i] for i, each in enumerate(run.plant.states)}
    assert min(s["pa"].min(), s["pb"].min(), s["line_pa"].min()) > 1.1 * ATM
    through = _through(rig, s["pa"], s["line_pa"], s["pb"])
    port_a, port_b, work, lost = _lands(rig, s["spool"], s["line_pa"], s["pb"])
    swept = rig["Aj"] * s["velocity"]
    volumes = [rig["V0"] + rig["Aj"] * (rig["S"] / 2 + sign * s["position"]) for sign in (1, -1)]

    def integral(rate: np.ndarray) -> float:
        return float(np.trapezoid(rate, t))

    moved = integral(np.abs(through))
    assert moved > 1e-4
    in_line = (
        rig["line_volume"] / rig["beta"] * np.ptp(state["PLA"][[0, -1]]) * np.sign(state["PLA"][-1] - state["PLA"][0])
    )
    assert integral(port_a - through) == pytest.approx(in_line, abs=2e-3 * moved)
    pressed = [float(np.trapezoid(v / rig["beta"], p)) for v, p in zip(volumes, (s["pa"], s["pb"]), strict=True)]
    assert integral(through - swept) == pytest.approx(pressed[0], abs=2e-3 * moved)
    assert integral(swept - port_b) == pytest.approx(pressed[1], abs=2e-3 * moved)

    dissipated = integral(through * (s["line_pa"] - s["pa"]))
    assert dissipated > 0.05 * integral(lost)
    stored = [float(np.trapezoid(v * p / rig["beta"], p)) for v, p in zip(volumes, (s["pa"], s["pb"]), strict=True)]
    stored.append(float(np.trapezoid(rig["line_volume"] * s["line_pa"] / rig["beta"], s["line_pa"])))
    kinetic = 0.5 * rig["M"] * (s["velocity"][-1] ** 2 - s["velocity"][0] ** 2)
    lifted = LOAD * (s["position"][-1] - s["position"][0])
    spent = integral(lost) + dissipated + sum(stored) + kinetic + lifted + integral(rig["b"] * s["velocity"] ** 2)
    assert integral(work) == pytest.approx(spent, abs=5e-3 * integral(lost))


def _through(rig: Rig, chamber: np.ndarray, line: np.ndarray, pilot: np.ndarray) -> np.ndarray:
    """Flow into the chamber by the law of either kind."""
    lifted = line - chamber - rig["line_cracking"]
    if rig.line_valve == LineValve(CHECK, "A"):
        return (
            rig["line_flow"]
            * share((lifted + 3 * np.maximum(pilot - line, 0)) / rig["line_lift"])
            * root(line - chamber)
        )
    opened = rig["line_return"] * share((chamber + 3 * pilot - 4 * line - rig["line_setting"]) / rig["line_span"])
    return (rig["line_flow"] * share(lifted / rig["line_lift"]) + opened) * root(line - chamber)


def _lands(rig: Rig, z: np.ndarray, pa: np.ndarray, pb: np.ndarray) -> tuple[np.ndarray, ...]:
    """Flow into port A and out of B [m^3/s], power [W] from the supply less that to the return, and that lost."""
    gradient, eps = rig["n"] * rig["K3"], rig["eps"]
    ahead, back = (np.where(to >= 0, to + eps, eps * np.exp(np.minimum(to, 0) / eps)) for to in (z, -z))
    fed = [gradient * o * root(rig["Ps"] - p) for o, p in ((ahead, pa), (back, pb))]
    drained = [gradient * o * root(p - rig["Pr"]) for o, p in ((back, pa), (ahead, pb))]
    work = sum(fed) * rig["Ps"] - sum(drained) * rig["Pr"]
    lost = sum(f * (rig["Ps"] - p) + d * (p - rig["Pr"]) for f, d, p in zip(fed, drained, (pa, pb), strict=True))
    return fed[0] - drained[0], drained[1] - fed[1], work, lost


# --- what takes a rig


RIGS = [("jack-10t", {}), ("festo-tp511", OF_FESTO), ("two-way-pump-rig", OF_FESTO), ("pump-rig", OF_FESTO)]


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("kind", LINE_VALVES)
@pytest.mark.parametrize(("name", "values"), RIGS)
def test_every_valve_drives_through_one(name, values, kind, side):
    """It extends and retracts at full command, no faster than without it."""
    rig, plain = with_valve(name, kind, side, **values), build(load_rig(name))
    plant = build(rig)
    assert plant.n == plain.n + len([on for on in SIDES[side] if on])
    for command in (1.0, -1.0):
        speed, free = (equilibrium(own, command=command).speed for own in (plant, plain))
        assert 0.1 * abs(free) < command * speed < 1.02 * abs(free)
    port = build_force_port(rig)
    assert port.n == plant.n - 2


@pytest.mark.parametrize("load", [2e4, 4e4, -3e4])
@pytest.mark.parametrize("kind", LINE_VALVES)
def test_an_operating_point_carries_a_load_at_rest(kind, load):
    """Both lines have a valve; the leakage past the piston has to come through one and go through the other."""
    rig, plant = with_valve("jack-10t", kind, "both"), engine(kind, "both").plant
    point = equilibrium(plant, disturbance=load)
    y = dict(zip(plant.outputs, plant.observe(point.x, point.u)[0], strict=True))
    assert rig["Aj"] * (y["pa"] - y["pb"]) == pytest.approx(load, rel=1e-6)
    fed, emptied = ("a", "b") if load > 0 else ("b", "a")
    assert y[f"line_p{fed}"] > y[f"p{fed}"]
    assert y[f"line_p{emptied}"] < y[f"p{emptied}"]


@pytest.mark.parametrize("kind", LINE_VALVES)
def test_slopes_are_those_of_the_graph_and_a_shut_valve_parts_the_command_from_the_jack(kind):
    plant = engine(kind).plant
    point = equilibrium(plant, speed=-0.3, disturbance=-LOAD)
    a = np.array(linearise(plant, point).A)
    for name in ("PLA", "P1", "P2"):
        i, step = plant.state(name), 1e2
        rates = [
            np.array(plant.f(point.x + sign * step * np.eye(plant.n)[i], point.u, plant.p)).ravel() for sign in (1, -1)
        ]
        assert a[:, i] == pytest.approx((rates[0] - rates[1]) / 2 / step, rel=1e-3, abs=1e-6 * np.abs(a[:, i]).max())
    shut = tight(kind)
    closed = build(shut)
    x = closed.start
    x[closed.state("P1")] += 20e5
    _, b, *_ = (np.array(part) for part in closed.slopes(x, np.zeros(len(closed.inputs)), closed.p))
    a = np.array(closed.slopes(x, np.zeros(len(closed.inputs)), closed.p)[0])
    assert a[closed.state("P1"), closed.state("PLA")] == 0
    assert not b[closed.state("P1")].any()


@pytest.mark.parametrize("effect", [e for e in LIBRARY if not e.delay], ids=lambda effect: effect.title)
def test_every_effect_of_the_library_acts_beside_it(effect):
    rig = with_valve("festo-tp511", COUNTERBALANCE, "both", **OF_FESTO)
    if not applies(effect, rig):
        pytest.skip("not of this valve")
    plant = build(rig, (effect,))
    assert np.isfinite(np.array(plant.f(plant.start, np.zeros(len(plant.inputs)), plant.p))).all()


def test_a_loop_closes_on_it_and_its_guard_does_not_take_the_valve_for_a_fault():
    """The lands do not see the chambers, so that their flow is no observer of the position."""
    rig = with_valve("jack-10t", COUNTERBALANCE, "both")
    assert not guard_shape(rig, ("position", "pa", "pb", "force"), ("position",)).observes
    assert guard_shape(load_rig("jack-10t"), ("position", "pa", "pb", "force"), ("position",)).observes
    run = wb.ClosedLoop(rig, wb.controller("controllers.p:P", gain="3 1/m"), ideal=True).step("10 mm", seconds=1.5)
    position = run.record.signals["position"]
    assert run.tripped is None
    assert position[-1] == pytest.approx(10e-3, abs=1e-3)
    s = run.record.signals
    power = supply_power(rig, s["spool"], s["line_pa"], s["line_pb"], s["supply"])
    assert supply_energy(rig, run).energy_j == pytest.approx(np.trapezoid(power, run.record.t))


def test_a_platform_stands_on_legs_with_check_valves_as_on_legs_without():
    """Gravity and the leakage past the pistons say the pressure differences, whatever is in the lines."""
    plain = load_platform("hexapod")
    rig = with_valve("jack-10t", CHECK, "both")
    legs = [replace(leg, rig=replace(leg.rig, line_valve=rig.line_valve, numbers=rig.numbers)) for leg in plain.legs]
    assert all(leg.rig.numbers == load_rig("jack-10t").numbers for leg in plain.legs)
    found = []
    for platform in (plain, replace(plain, legs=tuple(legs))):
        plant = build_platform(platform)
        point = platform_equilibrium(plant)
        y = plant.observe(point.x, point.u)[0]
        found.append([y[plant.output(f"leg{i}.load_pressure")] for i in range(1, 7)])
    assert found[1] == pytest.approx(found[0], rel=1e-4)


# --- rig files and fits


TABLE = """
[line_valve]
kind = "counterbalance"
side = "A"
line_volume = {value = 0.01, unit = "l", source = "hose"}
line_cracking = {value = 1, unit = "bar", source = "datasheet"}
line_lift = {value = 2, unit = "bar", source = "datasheet"}
line_flow = {value = 4e-7, unit = "m^3/s/Pa^0.5", source = "datasheet"}
line_ratio = {value = 3, unit = "1", source = "datasheet"}
line_setting = {value = 25, unit = "bar", source = "set by hand", bounds = [15, 40]}
line_span = {value = 20, unit = "bar", source = "datasheet"}
line_return = {value = 3e-7, unit = "m^3/s/Pa^0.5", source = "datasheet"}
line_back_ratio = {value = 4, unit = "1", source = "1 + pilot ratio: not vented"}
"""


def rig_file(folder: Path, table: str = TABLE) -> Path:
    path = folder / "mine.toml"
    path.write_text((files("workbench") / "rigs" / "festo-tp511.toml").read_text(encoding="utf-8") + table)
    return path


def test_a_rig_file_has_it_and_keeps_it(tmp_path):
    rig = load_rig(rig_file(tmp_path))
    assert rig.line_valve == LineValve(COUNTERBALANCE, "A")
    assert rig["line_setting"] == pytest.approx(25e5)
    save_rig(rig, tmp_path / "again.toml")
    again = load_rig(tmp_path / "again.toml")
    assert (again.line_valve, again.numbers) == (rig.line_valve, rig.numbers)
    assert rig.kind != replace(rig, line_valve=LineValve(COUNTERBALANCE, "B")).kind
    assert "counterbalance valve in line A" in repr(rig)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('kind = "counterbalance"', 'kind = "overcentre"', 'line_valve.kind = "overcentre"'),
        ('side = "A"', 'side = "C"', 'line_valve.side = "C"'),
        ('side = "A"\n', "", "line_valve.side: missing"),
        ("value = 3,", "value = -3,", "line_valve.line_ratio: -3 is outside 0.1 to 30"),
        ("line_span = {", "line_spam = {", 'line_valve.line_spam: unknown key; did you mean "line_span"?'),
        ('kind = "counterbalance"', 'kind = "check"', "line_valve.line_setting: unknown key"),
        ('value = 25, unit = "bar"', 'value = 25, unit = "l"', 'unit "l" cannot be converted to "Pa"'),
        ("[15, 40]", "[30, 40]", "line_valve.line_setting.bounds: the value is outside its own bounds"),
    ],
)
def test_a_wrong_table_is_one_line(tmp_path, capsys, old, new, said):
    assert TABLE.count(old) == 1
    path = rig_file(tmp_path, TABLE.replace(old, new))
    assert main(["show", str(path)]) == 2
    line = capsys.readouterr().err
    assert said in line
    assert line.count("\n") == 1


@pytest.mark.parametrize("command", ["capability", "valve-test"])
def test_sheets_that_take_the_chambers_pressures_for_those_of_the_lands_refuse_it(tmp_path, capsys, command):
    assert main([command, str(rig_file(tmp_path))]) == 2
    assert "its line valve parts the lands from the chambers" in capsys.readouterr().err


def test_show_names_it(tmp_path, capsys):
    assert main(["show", str(rig_file(tmp_path))]) == 0
    said = capsys.readouterr().out
    assert "second-order valve, differential jack, counterbalance valve in line A\n" in said
    assert "line_setting" in said


@pytest.mark.parametrize("true", [20e5, 33e5])
def test_a_fit_finds_the_setting_within_its_interval(tmp_path, true):
    """Set by hand to 25 bar in the file; viscous friction is free beside it."""
    rig = load_rig(rig_file(tmp_path))
    numbers = {name: replace(number, low=None, high=None) for name, number in rig.numbers.items()}
    numbers |= {name: rig.numbers[name] for name in ("line_setting", "b")}
    records = campaign(rig.with_values(line_setting=true))
    metrics = run_fit(records, replace(rig, numbers=numbers), 1, no_checkpoint, lambda _: None).metrics
    value, low, high = metrics["parameters"]["line_setting [Pa]"]
    assert low <= true <= high
    assert high - low < 0.1 * true
    assert value == pytest.approx(true, rel=0.03)
    assert metrics["chi2"]["heldout"] == pytest.approx(1.0, abs=0.06)
