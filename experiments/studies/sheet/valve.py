"""A drawn valve's sheet beside its truth: by equilibria where it stands, by finer runs without noise where it moves."""

from collections.abc import Mapping

import numpy as np

from workbench.base.gain_phase import gain_db, phase_deg
from workbench.commands.valve_test.study import played_sheet
from workbench.engine import Engine
from workbench.identify.acceptance.bench import ABOUT_NULL, FAST, TestBench, standing, steps
from workbench.identify.acceptance.dynamics import STEPS, step_figures
from workbench.identify.acceptance.exact import PER_MINUTE, curve_lines, curve_null, pilot_flow
from workbench.identify.acceptance.pressure import pressure_rows
from workbench.identify.acceptance.row import Row
from workbench.identify.acceptance.valve_test import valve_sheet
from workbench.linear.crossings import corner_frequency
from workbench.linear.frequency_response import stepped_sines
from workbench.linear.operating_point import equilibrium
from workbench.loop.drive_simulation import drive, recorded
from workbench.plant import build_blocked_valve, build_pilot_bench, build_valve_bench
from workbench.records import Record
from workbench.records.excitation import Excitation
from workbench.rigs.rig import Rig

from .drawn import Held, beside_truth, within_bounds

_FINER, _CYCLES = 4, (30, 30)  # times: steps of a truth; cycles of its sines
_NEAR = np.linspace(0.97, 1.03, 5)  # of a corner as found: where its truth is looked for
_REST = np.linspace(-1e-3, 1e-3, 201)  # of full command: where load pressure and leakage change


def bench_lines(rig: Rig, number: int) -> list[Held]:
    """Of a rig within the bounds: its valve on the test bench, sensors of seed `number`."""
    own = within_bounds(rig, np.random.default_rng([0, number]))
    found = played_sheet(TestBench(own, number), lambda _: None)
    assert found.curve is not None
    truths = curve_lines(own, found.curve.command) | _pressure_truth(own) | _step_truth(own)
    truths |= _corner_truth(own, found.rows)
    truths |= {
        "hysteresis": 0.0,
        "threshold": 0.0,
        "null_shift_supply": _shift_truth(own),
        "pilot_flow": pilot_flow(own),
    }
    return beside_truth(found.rows, truths)


def record_lines(rig: Rig, waves: Mapping[str, Excitation], number: int) -> list[Held]:
    """Of the records of a whole rig within the bounds, read with the rig that they were drawn about."""
    own = within_bounds(rig, np.random.default_rng([1, number]))
    ready, records = drive(own), []
    for i, (name, wave) in enumerate(waves.items()):
        signals = recorded(ready, wave, [number, i])["signals"]
        records.append(Record(name, np.arange(wave.command.size) * own.period.value, signals))
    found = valve_sheet(records, rig)
    truths = {} if found.curve is None else curve_lines(own, found.curve.command)
    return beside_truth(found.rows, truths | {"hysteresis": 0.0})


def _pressure_truth(rig: Rig) -> dict[str, float | None]:
    command = TestBench(rig, 0).null + np.concatenate(([-ABOUT_NULL], _REST, [ABOUT_NULL]))
    pa, pb, flow = standing(build_blocked_valve(rig), command, ("pa", "pb", "flow")).T
    record = Record("valve-pressure", np.arange(command.size) * 1.0, {"command": command, "pa": pa, "pb": pb})
    rows = {row.id: row.value for row in pressure_rows([record])}
    return {"pressure_gain": rows["pressure_gain"], "leakage": PER_MINUTE * float(flow.max())}


def _step_truth(rig: Rig) -> dict[str, float | None]:
    plant, period, truths = build_valve_bench(rig), FAST / _FINER, dict[str, float | None]()
    rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
    for size in STEPS:
        command = steps(size / 100, period)
        t = np.arange(command.size + 1) * period
        u = np.append(command, 0.0)[:, None]
        run = Engine(plant).run(rest.x, t, u)
        spool = plant.observe(run.x[:-1], u[:-1])[:, plant.output("spool")]
        record = Record(f"valve-step-{size}", t[:-1], {"command": command, "spool": spool})
        (time, *_), (over, *_) = step_figures(record, "spool", 0.0)
        truths |= {f"step_{size}_t90": time, f"step_{size}_overshoot": over}
    return truths


def _corner_truth(rig: Rig, rows: list[Row]) -> dict[str, float | None]:
    """Corners by sines of 50 cycles each, close to where they were found."""
    truths: dict[str, float | None] = {}
    for row in rows:
        if row.value is not None and row.id.endswith(("_f3db", "_f90")):
            stage, size, figure = row.id.split("_")
            truths[row.id] = _corner(rig, stage, int(size), figure, row.value)
    return truths


def _corner(rig: Rig, stage: str, size: int, figure: str, found: float) -> float | None:
    plant = build_pilot_bench(rig) if stage == "pilot" else build_valve_bench(rig)
    rest = equilibrium(plant, command=0.0, p=plant.without_dry_friction())
    f = np.append(10.0 if stage == "pilot" else 5.0, found * _NEAR)
    amplitude = size / 100 * plant.inputs[0].scale
    starts, p = np.tile(rest.x, (f.size, 1)), np.tile(plant.p, (f.size, 1))
    sine = stepped_sines(Engine(plant), starts, rest.u, f, amplitude, ["flow"], None, p, _CYCLES)
    response = sine.response["flow"] / sine.response["flow"][0]
    if figure == "f3db":
        return corner_frequency(f[1:], gain_db(response[1:]), -3.0)
    return corner_frequency(f[1:], phase_deg(sine.response["flow"])[1:], -90.0)


def _shift_truth(rig: Rig) -> float | None:
    """By equilibria at both supplies."""
    nodes, share = np.linspace(-0.01, 0.01, 21), 0.2
    nulls = [curve_null(rig.with_values(Ps=(1 + side * share) * rig["Ps"]), nodes) for side in (-1, 1)]
    return 100 * (nulls[1] - nulls[0]) * 10e5 / (2 * share * rig["Ps"])
