"""Every formula of the library against its docstring, evaluated a second time in numpy."""

import numpy as np
import pytest
from effect_laws import BETA, EPS, TRAVEL, evaluated, lap
from hypothesis import given, settings, strategies as st
from random_plants import oil
from scipy.signal import bessel, butter, freqs

from workbench.plant.effects import LIBRARY, find
from workbench.rigs.oil import ATMOSPHERE, GAS_CONTENT, VAPOUR_PRESSURE

FEW = settings(max_examples=25)
PS, PR = 210e5, 4e5
LIMIT, T0, FAST = 0.02, 1e-5, 5e-5
LAGS = {
    ("drive.lag", "amplifier"),
    ("drive.lag", "command filter"),
    ("drive.lag", "two poles"),
    ("drive.lag", "command two poles"),
    ("sensor.lag", "first order"),
    ("sensor.lag", "line"),
    *(("sensor.filter", f"{name} {order}") for name in ("bessel", "butterworth") for order in (2, 4)),
}


def sat(value, limit):
    return min(max(value, -limit), limit)


def q(drop):
    return drop / (drop**2 + 1e6) ** 0.25


# Each entry: name, formula, slot, what it is given, context, and the docstring: (value, p, x, context) -> value, rates.


def _hard(i, p, x, c):
    return sat(i, p["share"] * c["limit"]), {}


def _one_sided(i, p, x, c):
    top = p["share"] * c["limit"]
    return min(max(i, -top * (1 + min(p["less"], 0))), top * (1 - max(p["less"], 0))), {}


def _soft(i, p, x, c):
    return i / np.sqrt(1 + p["c"] * (i / c["limit"]) ** 2), {}


def _rapp(i, p, x, c):
    return i / (1 + p["c"] * (10 * abs(i) / c["limit"]) ** (2 * p["m"])) ** (0.5 / p["m"]), {}


def _lead_or_lag(u, p, x, c):
    slow = c["gain"] * x["c1"]
    return (1 + p["high"]) * u + (p["low"] - p["high"]) * slow, {"c1": (c["error"] - x["c1"]) / p["T"]}


def _pi(u, p, x, c):
    total = u + x["c0"]
    return total, {"c0": p["ki"] * (c["gain"] * c["error"] + sat(total, c["limit"]) - total)}


def _lead(u, p, x, c):
    rate = (c["error"] - x["c1"]) / p["tf"]
    return u + c["gain"] * p["Td"] * rate, {"c1": rate}


def _lead_on_spool(u, p, x, c):
    rate = (c["spool"] - x["c1"]) / p["tf"]
    return u - c["gain"] * p["Td"] * rate, {"c1": rate}


def _pi_lead_on_spool(u, p, x, c):
    u, first = _lead_on_spool(u, p, x, c)
    total, second = _pi(u, p, x, c)
    return total, first | second


def _pi_lead(u, p, x, c):
    u, first = _lead(u, p, x, c)
    total, second = _pi(u, p, x, c)
    return total, first | second


def _play(i, p, x, c):
    held = sat(i - x["w"], p["r"])
    return i - held, {"w": (i - x["w"] - held) / FAST}


def _plays(i, p, x, c):
    held = {f"w{j}": sat(i - x[f"w{j}"], 2 * j * p["r"] / 3) for j in (1, 2, 3)}
    return i - sum(held.values()) / 4, {name: (i - x[name] - h) / FAST for name, h in held.items()}


def _bouc_wen(i, p, x, c):
    di = (i - x["w"]) / FAST
    return i - p["a"] * p["width"] * x["z"], {"w": di, "z": (di - abs(di) * x["z"]) / p["width"]}


def _coulomb(v0):
    return lambda f, p, x, c: (f + p["Fc"] * np.tanh(c["velocity"] / v0), {})


def _line(loss):
    def docstring(pair, p, x, c):
        on, w0 = 1 - np.exp(-p["r"] / 1e-6), 2 * np.pi * p["f"]
        C = max(p["r"], 1e-2) * c["volume"] / c["beta"]
        (PA, a), (PB, b) = (oil({"Pr": c["saturation"], "beta": c["beta"]}, x[name]) for name in ("PA", "PB"))
        qA, qB = x["qA"] / (a if x["qA"] > 0 else c["room_a"]), x["qB"] / (b if x["qB"] < 0 else c["room_b"])
        passed = tuple(flow + on * (q - flow) for flow, q in zip(pair, (qA, qB), strict=True))
        QA, QB = pair[0] / (1 if pair[0] > 0 else a), pair[1] / (1 if pair[1] < 0 else b)
        return passed, {
            "PA": a * a * (QA - qA) / C,
            "PB": b * b * (qB - QB) / C,
            "qA": C * w0**2 * (PA - c["pa"] - loss(x["qA"], p, c, w0 * C)),
            "qB": C * w0**2 * (c["pb"] - PB - loss(x["qB"], p, c, w0 * C)),
        }

    return docstring


def _pressed(pressure):
    def docstring(f, p, x, c):
        level = p["Fc"] + p["Fp"] * pressure(c) / c["feed"]
        return f + level * np.tanh(c["velocity"] / 2e-3), {}

    return docstring


def _by_direction(f, p, x, c):
    return f + p["Fc_out" if c["velocity"] > 0 else "Fc_in"] * np.tanh(c["velocity"] / 2e-3), {}


def _bend(name):
    def docstring(y, p, x, c):
        full = c["high"] - c["low"]
        w = min(max((y - c["low"]) / full, 0), 1)
        return y + p[name] * full * 4 * w * (1 - w), {}

    return docstring


def _bend_each_way(y, p, x, c):
    w = min(abs(y) / c["high"], 1)
    return y + np.sign(y) * p["e"] * c["high"] * 4 * w * (1 - w), {}


def _stribeck(v0):
    def docstring(f, p, x, c):
        level = p["Fc"] + (p["Fs"] - p["Fc"]) * np.exp(-((c["velocity"] / p["vs"]) ** 2))
        return f + level * np.tanh(c["velocity"] / v0), {}

    return docstring


def _lugre(f, p, x, c):
    v, z = c["velocity"], x["z"]
    rate = (v - abs(v) * z / (1 + (p["ratio"] - 1) * np.exp(-((v / p["vs"]) ** 2)))) / p["d"]
    return f + p["Fc"] * (z + p["td"] * rate), {"z": rate}


def _shifted(_, p, x, c):
    d, z = p["overlap"] * TRAVEL, c["spool"]
    leak = EPS**2 / (EPS + d) - EPS * np.exp(-d / EPS)
    return (lap(z - d) + leak, lap(-z - d) + leak), {}


def _narrow(_, p, x, c):
    openings, _ = _shifted(_, p, x, c)
    return tuple(o / np.sqrt(1 + p["c"] * (o / TRAVEL) ** 2) for o in openings), {}


def _dead(_, p, x, c):
    d, z = p["overlap"] * TRAVEL, c["spool"]
    z -= 0.99 * sat(z, d)
    return (lap(z), lap(-z)), {}


def _smooth(_, p, x, c):
    d, w, z = p["overlap"] * TRAVEL, p["width"] * TRAVEL, c["spool"]
    z = w * (np.logaddexp(0, (z - d) / w) - np.logaddexp(0, (-z - d) / w))
    return (lap(z), lap(-z)), {}


def _symmetric(vd, p, x, c, T=None):
    v = c["velocity"]
    share = abs(v) * (p["T"] if T is None else T) / TRAVEL
    return (v + (vd - v) * sat(max(1 - share, 0) / 0.02, 1) if (vd - v) * v > 0 else vd), {}


def _two_sided(vd, p, x, c):
    return _symmetric(vd, p, x, c, p["T_up"] if c["velocity"] > 0 else p["T_down"])


def _demand(vd, p, x, c):
    return vd / max(1, abs(vd) * p["T"] / TRAVEL), {}


def _drawn(c):
    return (c["flow"] + c["other"]) / c["rated"]


def _largest_flow(_, p, x, c):
    left = max(p["share"] - c["other"] / c["rated"], 0)
    beyond = max(c["flow"] / c["rated"] - left, 0)
    return (), {"drop": ((c["supply"] + x["drop"]) * beyond / 0.05 - x["drop"]) / p["tau"]}


def _largest_power(_, p, x, c):
    lost = max(1 - p["share"] / max(_drawn(c), 1e-3), 0)
    return (), {"drop": ((c["supply"] + x["drop"]) * lost - x["drop"]) / p["tau"]}


def _pair_gain(pair, p, x, c):
    return (pair[0] * (1 + p["a"]), pair[1] * (1 - p["a"])), {}


def _curve(pair, p, x, c):
    bends = (p["c_extend"], p["c_retract"])
    return tuple(o * (1 + bend * (1 - o / TRAVEL)) for o, bend in zip(pair, bends, strict=True)), {}


def _laminar(_, p, x, c):
    return (), {"drop": (p["sag"] * _drawn(c) - x["drop"]) / p["tau"]}


def _orifice(_, p, x, c):
    return (), {"drop": (p["sag"] * _drawn(c) ** 2 - x["drop"]) / p["tau"]}


def _accumulator(_, p, x, c):
    gas, pump = c["supply"] / (c["supply"] + x["drop"]), p["pump"] * np.tanh(x["drop"] / 5e5)
    return (), {"drop": p["rate"] * 1.4 * c["supply"] * gas ** (1 / 1.4) * (_drawn(c) - pump)}


def _isothermal(beta, p, x, c):
    pressure = max(c["pressure"], 2e4)
    return beta / (1 + p["alpha"] * ATMOSPHERE / pressure * (beta / pressure - 1)), {}


def _polytropic(beta, p, x, c):
    pressure, alpha = max(c["pressure"], 2e4), p["alpha"]
    r = (ATMOSPHERE / pressure) ** (1 / 1.4)
    return (alpha * r + 1 - alpha) / (alpha * r / (1.4 * pressure) + (1 - alpha) / beta), {}


def _fixed(beta, p, x, c):
    return 1 / (1 / beta + p["x"] / (1.4 * max(c["pressure"], 2e4))), {}


def _four_edges(pair, p, x, c):
    into_a, out_of_b = pair
    return (
        into_a * (1 if into_a > 0 else 1 + p["a_return"]),
        out_of_b * (1 + p["b_return"] if out_of_b > 0 else 1 + p["p_b"]),
    ), {}


def _power(beta, p, x, c):
    return beta / (1 + p["x"] * (1e7 / max(c["pressure"], 2e4)) ** p["m"]), {}


def _leak_laminar(pair, p, x, c):
    return (pair[0] + p["CA"] * (c["pa"] - PR), pair[1] + p["CB"] * (c["pb"] - PR)), {}


def _leak_orifice(pair, p, x, c):
    return (pair[0] + p["kA"] * q(c["pa"] - PR), pair[1] + p["kB"] * q(c["pb"] - PR)), {}


def _bias(f, p, x, c):
    return f + p["F"], {}


def _spring(f, p, x, c):
    return f + p["k"] * (c["position"] - p["x0"]), {}


def _hardening(f, p, x, c):
    away = c["position"] - p["x0"]
    return f + p["k"] * away + p["k3"] * away**3, {}


def _hanging(a, p, x, c):
    w0 = 2 * np.pi * p["f"]
    pull = w0**2 * x["y"] + 2 * p["zeta"] * w0 * x["vy"]
    carried = (a + p["mu"] * pull) / (1 - p["mu"])
    return carried, {"y": x["vy"], "vy": -carried - pull}


def _mount(a, p, x, c):
    w0 = 2 * np.pi * p["f"]
    back = -(w0**2) * (x["y"] + p["c"] * c["rod_force"]) - 2 * p["zeta"] * w0 * x["vy"]
    return a, {"y": x["vy"], "vy": back}


def _relief_beyond(c, p):
    drop = c["pa"] - c["pb"]
    return max(drop - p["p0"], 0), max(-drop - p["p0"], 0)


def _relief_linear(pair, p, x, c):
    forward, backward = _relief_beyond(c, p)
    flow = p["G"] * (forward - backward)
    return (pair[0] + flow, pair[1] - flow), {}


def _relief_orifice(pair, p, x, c):
    forward, backward = _relief_beyond(c, p)
    flow = p["k"] * (q(forward) - q(backward))
    return (pair[0] + flow, pair[1] - flow), {}


def _pull(p, x):
    w0, into = 2 * np.pi * p["f"], x["y"] - sat(x["y"], p["gap"] / 2)
    return w0**2 * into + 2 * p["zeta"] * w0 * x["vy"] * abs(into) / (abs(into) + p["gap"] / 100 + 1e-9)


def _backlash(a, p, x, c):
    rod = (a + p["mu"] * _pull(p, x)) / (1 - p["mu"])
    return rod, {"y": x["vy"], "vy": -rod - _pull(p, x)}


def some(low, high):
    return st.floats(low, high)


CURRENT, DEMAND, FLOW = some(-0.03, 0.03), some(-3, 3), some(0, 0.03)
SPOOL, PRESSURE, FORCE = some(-1.1 * TRAVEL, 1.1 * TRAVEL), some(-2e6, 4e7), some(-1e5, 1e5)
OPENINGS = st.tuples(some(0, TRAVEL), some(0, TRAVEL))
FLOWS = st.tuples(some(-0.02, 0.02), some(-0.02, 0.02))
LIMITED = {"limit": st.just(LIMIT)}
AT_FULL = {"limit": st.just(1.0)}
SPEED, SPOOL_SPEED = some(-2, 2), {"velocity": some(-0.5, 0.5), "travel": st.just(TRAVEL)}
LOOP = {"error": some(-2, 2), "spool": some(-1, 1), "gain": st.just(0.6), "limit": st.just(1.0)}
RUBBING = {"velocity": some(-1, 1)}
Z = {"spool": SPOOL, "lap": st.just(EPS), "travel": st.just(TRAVEL)}
DRAWN = {"flow": FLOW, "other": some(0, 0.01), "rated": st.just(0.02), "supply": some(2e6, PS)}
OIL = {"pressure": PRESSURE}
CHAMBERS = {"pa": PRESSURE, "pb": PRESSURE, "drain": st.just(PR)}
PLACE = {"position": some(-0.25, 0.25)}
SCALE = {"low": st.just(-0.25), "high": st.just(0.25)}
GAUGE = {"low": st.just(0.0), "high": st.just(PS)}
LINE = {"pa": PRESSURE, "pb": PRESSURE, "volume": st.just(1e-3), "beta": st.just(BETA)}
LINE |= {"rated": st.just(0.02), "feed": st.just(PS), "room_a": some(1, 3), "room_b": some(1, 3)}
LINE |= {"saturation": st.just(ATMOSPHERE), "vapour": st.just(VAPOUR_PRESSURE), "gas": st.just(GAS_CONTENT)}
NONE = st.none()


def _warms(_, p, x, c):
    return [], {"warmth": (c["flow"] / c["rated"] - x["warmth"]) / p["tau"]}


def _thins(force, p, x, c):
    return force + c["viscous"] * c["velocity"] * (1 / (1 + p["w"] * max(x["warmth"], 0)) - 1), {}


def _leaks_more(leaks, p, x, c):
    more = p["w"] * max(x["warmth"], 0) * c["internal"] * (c["pa"] - c["pb"])
    return (leaks[0] + more, leaks[1] - more), {}


def _flows_more(flows, p, x, _):
    return tuple(flow * (1 + p["g"] * max(x["warmth"], 0)) for flow in flows), {}


WARMED = (
    ("supply_flow", NONE, DRAWN, _warms),
    ("friction", FORCE, RUBBING | {"viscous": some(0, 1e4)}, _thins),
    ("leakage", FLOWS, CHAMBERS | {"internal": some(0, 1e-10)}, _leaks_more),
    ("line_flows", FLOWS, {}, _flows_more),
)
DOCSTRINGS = (
    *(("oil.warming", "viscosity", *each) for each in WARMED[:3]),
    *(("oil.warming", "viscosity and gain", *each) for each in WARMED),
    ("drive.saturation", "hard", "current", CURRENT, LIMITED, _hard),
    ("drive.saturation", "one-sided", "current", CURRENT, LIMITED, _one_sided),
    ("drive.saturation", "soft", "current", CURRENT, LIMITED, _soft),
    ("drive.saturation", "rapp", "current", CURRENT, LIMITED, _rapp),
    ("drive.saturation", "command hard", "command", DEMAND, AT_FULL, _hard),
    ("drive.saturation", "command one-sided", "command", DEMAND, AT_FULL, _one_sided),
    ("drive.saturation", "command soft", "command", DEMAND, AT_FULL, _soft),
    ("drive.saturation", "command rapp", "command", DEMAND, AT_FULL, _rapp),
    ("drive.corrector", "first order", "corrector", DEMAND, LOOP, _lead_or_lag),
    ("drive.corrector", "pi", "corrector", DEMAND, LOOP, _pi),
    ("drive.corrector", "lead", "corrector", DEMAND, LOOP, _lead),
    ("drive.corrector", "pi-lead", "corrector", DEMAND, LOOP, _pi_lead),
    ("drive.corrector", "lead on the spool", "corrector", DEMAND, LOOP, _lead_on_spool),
    ("drive.corrector", "pi, lead on the spool", "corrector", DEMAND, LOOP, _pi_lead_on_spool),
    ("pilot.hysteresis", "play", "motor_current", CURRENT, {}, _play),
    ("pilot.hysteresis", "prandtl-ishlinskii", "motor_current", CURRENT, {}, _plays),
    ("pilot.hysteresis", "bouc-wen", "motor_current", CURRENT, {}, _bouc_wen),
    ("pilot.hysteresis", "magnet play", "magnet", DEMAND, {}, _play),
    ("pilot.hysteresis", "magnet prandtl-ishlinskii", "magnet", DEMAND, {}, _plays),
    ("pilot.hysteresis", "magnet bouc-wen", "magnet", DEMAND, {}, _bouc_wen),
    ("main.stiction", "coulomb", "main_friction", FORCE, RUBBING, _coulomb(2e-4)),
    ("main.stiction", "stribeck", "main_friction", FORCE, RUBBING, _stribeck(2e-4)),
    ("main.stiction", "lugre", "main_friction", FORCE, RUBBING, _lugre),
    ("main.stiction", "relative coulomb", "spool_friction", DEMAND, RUBBING, _coulomb(2e-4)),
    ("main.stiction", "relative stribeck", "spool_friction", DEMAND, RUBBING, _stribeck(2e-4)),
    ("main.stiction", "relative lugre", "spool_friction", DEMAND, RUBBING, _lugre),
    ("main.deadband", "lap", "main_openings", OPENINGS, Z, _shifted),
    ("main.deadband", "lap, narrow passages", "main_openings", OPENINGS, Z, _narrow),
    ("main.deadband", "linear", "main_openings", OPENINGS, Z, _dead),
    ("main.deadband", "smooth", "main_openings", OPENINGS, Z, _smooth),
    ("main.deadband", "linear, with jump", "main_openings", OPENINGS, Z, _dead),
    ("main.rate", "symmetric", "spool_speed", SPEED, SPOOL_SPEED, _symmetric),
    ("main.rate", "two-sided", "spool_speed", SPEED, SPOOL_SPEED, _two_sided),
    ("main.rate", "demand", "spool_speed", SPEED, SPOOL_SPEED, _demand),
    ("main.asymmetry", "direction", "main_openings", OPENINGS, Z, _pair_gain),
    ("main.asymmetry", "lands", "main_flows", FLOWS, {}, _pair_gain),
    ("main.asymmetry", "edges", "main_flows", FLOWS, {}, _four_edges),
    ("main.asymmetry", "curve", "main_openings", OPENINGS, Z, _curve),
    ("supply.sag", "laminar", "supply_flow", NONE, DRAWN, _laminar),
    ("supply.sag", "orifice", "supply_flow", NONE, DRAWN, _orifice),
    ("supply.sag", "accumulator", "supply_flow", NONE, DRAWN, _accumulator),
    ("supply.limit", "flow", "supply_flow", NONE, DRAWN, _largest_flow),
    ("supply.limit", "power", "supply_flow", NONE, DRAWN, _largest_power),
    ("line.hose", "lumped", "line_flows", FLOWS, LINE, _line(lambda q, p, c, z: 2 * p["zeta"] * q / z)),
    (
        "line.hose",
        "turbulent",
        "line_flows",
        FLOWS,
        LINE,
        _line(lambda q, p, c, _: p["loss"] * c["feed"] * q * abs(q) / c["rated"] ** 2),
    ),
    ("oil.air", "isothermal", "modulus", st.just(BETA), OIL, _isothermal),
    ("oil.air", "polytropic", "modulus", st.just(BETA), OIL, _polytropic),
    ("oil.air", "fixed share", "modulus", st.just(BETA), OIL, _fixed),
    ("oil.air", "power", "modulus", st.just(BETA), OIL, _power),
    ("jack.external_leakage", "laminar", "leakage", FLOWS, CHAMBERS, _leak_laminar),
    ("jack.external_leakage", "orifice", "leakage", FLOWS, CHAMBERS, _leak_orifice),
    ("jack.friction", "coulomb", "friction", FORCE, RUBBING, _coulomb(2e-3)),
    ("jack.friction", "stribeck", "friction", FORCE, RUBBING, _stribeck(2e-3)),
    ("jack.friction", "lugre", "friction", FORCE, RUBBING, _lugre),
    (
        "jack.friction",
        "pressed by the difference",
        "friction",
        FORCE,
        RUBBING | {"drop": some(-4e7, 4e7), "feed": st.just(PS)},
        _pressed(lambda c: abs(c["drop"])),
    ),
    (
        "jack.friction",
        "pressed by the mean",
        "friction",
        FORCE,
        RUBBING | {"mean": PRESSURE, "feed": st.just(PS)},
        _pressed(lambda c: max(c["mean"], 0)),
    ),
    ("jack.friction", "by direction", "friction", FORCE, RUBBING, _by_direction),
    ("sensor.bend", "position", "sensor_position", some(-0.3, 0.3), SCALE, _bend("e")),
    ("sensor.bend", "force", "sensor_force", FORCE, {"high": st.just(8e4)}, _bend_each_way),
    ("sensor.bend", "pressures", "sensor_pa", PRESSURE, GAUGE, _bend("a")),
    ("jack.crossport_relief", "linear", "leakage", FLOWS, CHAMBERS, _relief_linear),
    ("jack.crossport_relief", "orifice", "leakage", FLOWS, CHAMBERS, _relief_orifice),
    ("load.backlash", "measured on the rod", "acceleration", some(-50, 50), {}, _backlash),
    ("load.backlash", "measured on the load", "acceleration", some(-50, 50), {}, _backlash),
    ("load.bias", "weight", "body_force", FORCE, {}, _bias),
    ("load.bias", "preload", "load", FORCE, {}, _bias),
    ("load.spring", "linear", "load", FORCE, PLACE, _spring),
    ("load.spring", "hardening", "load", FORCE, PLACE, _hardening),
    ("load.compliance", "load", "acceleration", some(-50, 50), {}, _hanging),
    ("load.compliance", "mount", "acceleration", some(-50, 50), {"rod_force": FORCE}, _mount),
)


@pytest.mark.parametrize("entry", DOCSTRINGS, ids=lambda e: f"{e[0]}-{e[1]}-{e[2]}")
@settings(max_examples=25)
@given(data=st.data())
def test_a_formula_is_its_docstring(entry, data):
    name, formula, slot, given_value, context, docstring = entry
    effect = find(name, formula)
    value = data.draw(given_value)
    p = {n.name: data.draw(st.floats(n.low, n.high)) for n in effect.numbers}
    x = {s.name: data.draw(st.floats(-s.scale, s.scale)) for s in effect.states}
    c = {key: data.draw(strategy) for key, strategy in context.items()}
    result, rates = evaluated(effect, slot, value, p, x, **c)
    expected, expected_rates = docstring(value, p, x, c)
    assert np.isfinite(result).all()
    assert result == pytest.approx(list(np.atleast_1d(expected)), rel=1e-9, abs=1e-15)
    assert rates.keys() == expected_rates.keys()
    assert rates == {key: pytest.approx(rate, rel=1e-7, abs=1e-9) for key, rate in expected_rates.items()}


def test_every_formula_is_tested_against_its_docstring():
    tested = {entry[:2] for entry in DOCSTRINGS} | LAGS | {("drive.delay", "shift"), ("drive.delay", "interpolated")}
    assert tested == {(effect.name, effect.formula) for effect in LIBRARY}
    for effect in LIBRARY:
        assert all(law.__doc__ for law in effect.laws.values())


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("design", [bessel, butter])
@FEW
@given(tau=some(2e-4, 0.05), ratio=some(0.0, 3.0))
def test_a_logger_s_filter_is_that_of_the_tables(design, order, tau, ratio):
    """Beside the 10 us that a time constant cannot fall below; its gain is -3 dB at 1/(2 pi tau)."""
    norm = {"norm": "mag"} if design is bessel else {}
    b, a = design(order, 1.0, analog=True, **norm)
    frequency, name = ratio / (2 * np.pi * tau), "butterworth" if design is butter else "bessel"
    for slot in ("sensor_pa", "sensor_acceleration"):
        got = response(find("sensor.filter", f"{name} {order}"), slot, tau, frequency)
        assert abs(got - freqs(b, a, [ratio])[1][0]) < 3 * order * ratio * T0 / tau + 1e-9


@FEW
@given(a=some(-50, 50), mu=some(0.01, 0.95), y=some(-1e-3, 1e-3), vy=some(-1, 1))
def test_a_load_behind_a_play_is_measured_where_it_is_and_takes_no_momentum_from_nowhere(a, mu, y, vy):
    """Both masses together answer the force as one: (1 - mu) a1 + mu a2 = F/M."""
    play, p, x = find("load.backlash", "measured on the load"), {"mu": mu}, {"y": y, "vy": vy}
    (on_rod,), rates = evaluated(play, "acceleration", a, p, x)
    for slot, moved in (("position", y), ("velocity", vy), ("acceleration", rates["vy"])):
        (seen,), _ = evaluated(play, f"sensor_{slot}", on_rod, p, x)
        assert seen == pytest.approx(on_rod + moved, rel=1e-9, abs=1e-9)
    assert (1 - mu) * on_rod + mu * seen == pytest.approx(a, rel=1e-9, abs=1e-6)


@FEW
@given(u=some(-1, 1), jump=some(0, 0.6))
def test_a_jump_is_added_to_the_command_s_sign(u, jump):
    effect = find("main.deadband", "linear, with jump")
    (got,), _ = evaluated(effect, "command", u, {"jump": jump})
    assert got == pytest.approx(u + jump * np.tanh(u / 2e-3), rel=1e-9, abs=1e-15)


def response(effect, slot, tau, frequency, **p):
    """Frequency response of a linear law, from its matrices."""
    places = {s.name: s.of or ("sensor_p" + s.name[0] if slot.startswith("sensor") else slot) for s in effect.states}
    names = [name for name, place in places.items() if place == slot]
    numbers = {"tau": tau, **p}

    def column(value, **x):
        out, rates = evaluated(effect, slot, value, numbers, x, rest=0.0)
        return np.array([*(rates[name] for name in names), *out])

    b = column(1.0)
    a = np.stack([column(0.0, **{name: 1.0}) for name in names], axis=1)
    n = len(names)
    s = 2j * np.pi * frequency
    return a[n:, :n] @ np.linalg.solve(s * np.eye(n) - a[:n], b[:n]) + b[n:]


@pytest.mark.parametrize(
    ("name", "formula", "slot"),
    [
        ("drive.lag", "amplifier", "current"),
        ("drive.lag", "command filter", "command"),
        ("drive.lag", "two poles", "current"),
        ("drive.lag", "command two poles", "command"),
        ("sensor.lag", "first order", "sensor_pa"),
        ("sensor.lag", "first order", "sensor_pb"),
        ("sensor.lag", "line", "sensor_pa"),
        ("sensor.lag", "line", "sensor_pb"),
    ],
)
@settings(max_examples=20)
@given(tau=st.floats(0, 0.05), frequency=st.floats(0, 2000), zeta=st.floats(0.05, 1.5))
def test_a_lag_is_a_pole_over_a_10_us_zero(name, formula, slot, tau, frequency, zeta):
    """Its gain at rest is 1, at tau = 0 it is nothing, and below 300 Hz it is the plain lag that its docstring says."""
    s = 2j * np.pi * frequency
    if formula == "line" or formula.endswith("two poles"):
        got, plain = response(find(name, formula), slot, tau, frequency, zeta=zeta), (2 * zeta, 1)
    else:
        got, plain = response(find(name, formula), slot, tau, frequency), (1, 0)

    def lag(time):
        return 1 + plain[0] * time * s + plain[1] * (time * s) ** 2

    assert got == pytest.approx(lag(T0) / lag(tau + T0), rel=1e-9)
    assert response(find(name, formula), slot, tau, 0.0) == pytest.approx(1.0, rel=1e-12)
    assert response(find(name, formula), slot, 0.0, frequency) == pytest.approx(1.0, rel=1e-9)
    if frequency < 300 and tau > 1e-3 and plain[1] == 0:
        assert got == pytest.approx(1 / lag(tau), rel=0.03)
