"""Rigs with a second-order valve, drawn over what people have: a datasheet, with what it is off by as bounds."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from workbench.rigs.datasheet import Datasheet, build_rig
from workbench.rigs.load import ROD_CELL
from workbench.rigs.number import Number
from workbench.rigs.rig import Rig, number_specs

SECOND_ORDER = "second-order"
SUPPLIES = (140e5, 210e5, 280e5)  # Pa
STALL, STROKE = (25e3, 500e3), (0.1, 0.5)  # N; m
SPEED, MOST_FLOW = (0.08, 1.0), 0.8 / 60  # m/s at half the supply pressure a land; m^3/s that a valve gives
RATIO = (1.25, 2.0)  # of the areas of a differential jack
VALVE, DAMPING, OIL = (30.0, 120.0), (0.5, 1.0), (15.0, 70.0)  # Hz of the valve; of the mass on the oil [Hz]
TRAVEL, LAP = (0.5e-3, 3e-3), (2e-3, 6e-3)  # m; leak at null as a lap, over full travel
BETWEEN_CELL = (0.02, 0.2)  # of the moving mass, between piston and load cell
_DIGITS = 4


def second_order_rig(seed: int) -> Rig:
    """The rig of a seed. Force and supply give its area, speed its valve's flow, and oil the mass that it carries."""
    drawn = np.random.default_rng([seed, *SECOND_ORDER.encode()])
    supply, jack = float(drawn.choice(SUPPLIES)), str(drawn.choice(("double-rod", "differential")))
    area = _between(drawn, STALL) / supply
    areas = {"Aj": area} if jack == "double-rod" else {"AA": area, "AB": area / _between(drawn, RATIO)}
    both, stroke = area + min(areas.values()), _between(drawn, STROKE)
    speed = _between(drawn, (SPEED[0], min(SPEED[1], MOST_FLOW / area)))
    travel = _between(drawn, TRAVEL)
    lap = travel * _between(drawn, LAP)
    oil = 1e9 * both / (0.6 * stroke)  # N/m, by the rules of thumb for what a sheet does not say
    mass = oil / (2 * np.pi * _between(drawn, OIL)) ** 2
    valve = {
        "f0": _between(drawn, VALVE),
        "zeta": _between(drawn, DAMPING),
        "z0": 0.0,
        "K3": speed * both / 2 / np.sqrt(supply / 2) / (travel + lap),
        "z3max": travel,
        "eps": lap,
        "n": 1.0,
    }
    stated = {"Ps": supply, "Pr": 3e5, "S": stroke, "M": mass, **areas}
    specs = number_specs(SECOND_ORDER, "p", jack, ROD_CELL)
    numbers = {name: _number(name, value, specs[name].unit) for name, value in (stated | valve).items()}
    name = f"{SECOND_ORDER}-{seed}"
    given = {key: numbers[key] for key in stated}
    sheet = Datasheet(name, "", "drawn", SECOND_ORDER, jack, {}, {}, (), given, 0.0, None, {}, {})
    rig = build_rig(sheet, {key: numbers[key] for key in valve})
    return _measured(rig, _number("Mr", mass * _between(drawn, BETWEEN_CELL), "kg"), drawn)


def _measured(rig: Rig, beyond: Number, drawn: np.random.Generator) -> Rig:
    """With its sensors: a spool, a load cell beyond the mass `beyond` and an acceleration or not."""
    has: Mapping[str, bool] = {
        "spool": drawn.random() < 0.5,
        "force": drawn.random() < 0.4,
        "acceleration": drawn.random() < 0.5,
    }
    sensors = {name: sensor for name, sensor in rig.sensors.items() if has.get(name, True)}
    if not has["force"]:
        return replace(rig, sensors=sensors)
    return replace(rig, sensors=sensors, load=ROD_CELL, numbers={**rig.numbers, beyond.name: beyond})


def _number(name: str, value: float, unit: str) -> Number:
    return Number(name, float(f"{value:.{_DIGITS}g}"), unit, unit, "drawn")


def _between(drawn: np.random.Generator, band: tuple[float, float]) -> float:
    return float(np.exp(drawn.uniform(*np.log(band))))
