"""Windows with free initial states, and the numbers that are fitted over them: on records that our own plant made."""

from dataclasses import replace

import numpy as np
import pytest
from made_campaigns import PERIOD, SIGMA, commands, made

from workbench.base.errors import InputError
from workbench.base.signals import MEASURED
from workbench.identify.data.noise_floor import NoiseFloor
from workbench.identify.fit import solver
from workbench.identify.fit.determined import FreeParameter
from workbench.identify.fit.free_parameters import uncertain
from workbench.identify.fit.initial_states import fit_states
from workbench.identify.fit.model import Model
from workbench.identify.fit.normal_equations import numbers_at, ranges
from workbench.identify.fit.solver import Fit, fit_numbers
from workbench.identify.fit.windows import Windows, cut_windows, delayed
from workbench.identify.trace.shape import shape
from workbench.plant import build
from workbench.records import Record
from workbench.rigs.rig_file import load_rig

FLOOR = NoiseFloor(SIGMA, dict.fromkeys(SIGMA, 1.0), dict.fromkeys(SIGMA, "made"))
QUIET = dict.fromkeys(SIGMA, 0.0)
VALUES = {"K3": 6.3e-5, "f0": 70.0, "b": 130.0, "M": 8.0, "V0A": 3e-5}


@pytest.fixture(scope="module")
def rig():
    return load_rig("festo-tp511")


@pytest.fixture(scope="module")
def model(rig):
    return Model(build(rig), [name for name in MEASURED if name in SIGMA])


def windows_of(rig, model, sigma=SIGMA, **values) -> Windows:
    """Steps and a triangle of the rig with other values."""
    true = rig.with_values(**values)
    records = [
        made(true, name, u, seed, sigma) for seed, (name, u) in enumerate(zip("ab", commands(1.5)[:2], strict=True))
    ]
    return cut_windows(model.plant, records, FLOOR)


def fitted(model, windows: Windows, free: tuple[FreeParameter, ...]) -> Fit:
    guess = model.starts(windows, model.plant.p)
    return fit_numbers(model, windows, free, np.zeros(len(free)), model.plant.p, guess, np.ones(len(windows.names)))


def ramp(n: int = 50) -> Record:
    t = np.arange(n) * PERIOD
    return Record("ramp", t, {"command": np.sin(2 * np.pi * 3 * t) ** 3})


# --- the delay of a command


@pytest.mark.parametrize("rows", [1, 3, 7])
def test_a_delay_of_whole_samples_is_an_exact_shift(rows):
    record = ramp()
    command = record.signals["command"]
    late = delayed(record, rows * PERIOD).mean
    assert late[rows:] == pytest.approx(command[:-rows], abs=1e-12)
    assert late[:rows] == pytest.approx(command[0], abs=1e-12)  # what was before the record is its first value


def test_a_delay_of_part_of_a_sample_is_the_mean_over_the_interval():
    record = ramp()
    command = record.signals["command"]
    late = delayed(record, 0.25 * PERIOD).mean
    assert late[1:] == pytest.approx(0.75 * command[1:] + 0.25 * command[:-1], abs=1e-12)


@pytest.mark.parametrize(("share", "before"), [(0.0, 0), (0.25, 1), (2.0, 2), (2.6, 3)])
def test_what_has_arrived_by_a_row_is_one_sample_or_a_mean(share, before):
    record = ramp()
    command = record.signals["command"]
    late, mean = delayed(record, share * PERIOD), delayed(record, share * PERIOD, interpolated=True)
    assert np.array_equal(late.now[before:], command[: len(command) - before])
    assert np.array_equal(late.mean, mean.mean)
    assert np.array_equal(mean.now, mean.mean)


@pytest.mark.parametrize("delay", [0.0, 0.3 * PERIOD, 2.6 * PERIOD])
def test_the_slope_of_a_delay_is_its_derivative(delay):
    record, step = ramp(), 1e-6 * PERIOD
    ahead, behind = delayed(record, delay + step).mean, delayed(record, delay).mean
    assert delayed(record, delay).slope == pytest.approx((ahead - behind) / step, abs=1e-3)


# --- windows


def test_windows_cover_a_record_and_the_last_takes_the_rest(rig, model):
    record = made(rig, "long", np.zeros(round(1.7 / PERIOD)), 0)
    windows = cut_windows(model.plant, [record], FLOOR)
    assert windows.spans == ((0, 10, 260), (0, 260, 510), (0, 510, 850))
    assert windows.samples == len(SIGMA) * 840


def test_no_window_reaches_over_a_gap(rig, model):
    record = made(rig, "gap", np.zeros(round(1.0 / PERIOD)), 0)
    keep = np.ones(record.t.size, bool)
    keep[300] = False
    torn = Record("torn", record.t[keep], {name: values[keep] for name, values in record.signals.items()})
    assert cut_windows(model.plant, [torn], FLOOR).spans == ((0, 10, 300), (0, 310, 499))


def test_a_record_without_command_or_without_a_shared_signal_is_refused(model):
    t = np.arange(300) * PERIOD
    with pytest.raises(InputError, match="no command"):
        cut_windows(model.plant, [Record("mute", t, {"pa": 1e5 + t})], FLOOR)
    with pytest.raises(InputError, match="no signal"):
        cut_windows(model.plant, [Record("blind", t, {"command": t})], FLOOR)


def test_initial_states_are_found_from_a_bad_guess(rig, model):
    windows = windows_of(rig, model, QUIET)
    x0, squares = fit_states(model, windows, model.starts(windows, model.plant.p), model.plant.p)
    assert squares.max() < 0.1  # in units of the noise that the floor tells of
    off = x0 + 0.02 * model.plant.scale
    again, squares = fit_states(model, windows, off, model.plant.p)
    assert squares.sum() < 0.02 * sum(float(np.sum(e**2)) for e in model.errors(windows, off, model.plant.p))
    moved = np.abs((again - x0) / model.plant.scale)
    assert moved[:, [model.plant.state("x"), model.plant.state("P1")]].max() < 2e-3


# --- numbers


def test_a_fit_finds_the_true_numbers_within_its_intervals(rig, model):
    windows = windows_of(rig, model, **VALUES)
    fit = fitted(model, windows, uncertain(rig))
    true = rig.with_values(**VALUES)
    assert fit.ok
    assert fit.chi2 == pytest.approx(1.0, abs=0.05)
    inside = []
    for index, free in enumerate(fit.free):
        low, high = fit.interval(index)
        middle, half = (low + high) / 2, (high - low) / 2
        inside.append(low <= true[free.name] <= high)
        assert abs(true[free.name] - middle) < 2 * half + 1e-9 * abs(middle), free.name
    assert np.mean(inside) >= 0.8
    assert fit.p[model.plant.parameters.index("K3")] == pytest.approx(VALUES["K3"], rel=5e-3)


def test_slopes_at_a_place_are_computed_once(rig, model, monkeypatch):
    """They are what a fit costs."""
    windows, asked = windows_of(rig, model, **VALUES), []
    slopes_of = solver.slopes_of

    def counted(model, windows, x0, p, free, x):
        asked.append((x.tobytes(), x0.tobytes()))
        return slopes_of(model, windows, x0, p, free, x)

    monkeypatch.setattr(solver, "slopes_of", counted)
    fitted(model, windows, uncertain(rig))
    assert len(asked) > 3
    assert len(set(asked)) == len(asked)


def test_a_fit_that_goes_on_from_a_fit_ends_where_one_from_afar_does(rig, model):
    windows, free = windows_of(rig, model, **VALUES), uncertain(rig)
    afar = fitted(model, windows, free)
    x = np.clip(afar.x + 0.1, *ranges(free)[:2])
    p = numbers_at(model, free, x, model.plant.p)
    again = fit_numbers(model, windows, free, x, p, afar.x0, np.ones(len(windows.names)), near=True)
    assert again.squares.sum() == pytest.approx(afar.squares.sum(), abs=1.0)  # in units of the noise's variance
    known = np.sqrt(np.diag(afar.covariance))
    assert np.all(np.abs(again.x - afar.x) < 0.5 * known)


def test_a_fit_that_leaves_too_much_is_the_descent_alone(rig, model, monkeypatch):
    refreshed = []
    monkeypatch.setattr(solver, "escape_bad_starts", lambda *at: refreshed.append(at) or (at[3], at[3], np.zeros(1)))
    windows, free, p = windows_of(rig, model, **VALUES), uncertain(rig), model.plant.p
    at = model, windows, free, np.zeros(len(free)), p, model.starts(windows, p), np.ones(len(windows.names))
    whole = fit_numbers(*at)
    asked = len(refreshed)
    alone = fit_numbers(*at, most=0.5 * whole.squares.sum())
    assert asked > 0
    assert len(refreshed) == asked
    assert np.array_equal(alone.x, whole.x)
    assert np.array_equal(alone.covariance, whole.covariance)
    assert np.array_equal(fit_numbers(*at, most=2 * whole.squares.sum()).x, whole.x)
    assert len(refreshed) == 2 * asked


def test_a_number_stays_in_its_range_and_is_said_to_be_at_its_end(rig, model):
    windows = windows_of(rig, model, K3=6.3e-5)
    numbers = {**rig.numbers, "K3": replace(rig.numbers["K3"], low=5e-5, high=6e-5)}
    fit = fitted(model, windows, uncertain(replace(rig, numbers=numbers)))
    assert fit.p[model.plant.parameters.index("K3")] == pytest.approx(6e-5, rel=1e-9)
    assert "K3" in fit.at_bounds
    assert fit.interval([free.name for free in fit.free].index("K3"))[1] <= 6e-5 * (1 + 1e-12)


def test_what_the_records_do_not_show_keeps_its_whole_range(rig, model):
    """No record reaches an end stop, so none tells its stiffness."""
    stop = FreeParameter("ke", 1e7, 5e6, 2e7, 5e6, "made up")
    speed = next(free for free in uncertain(rig) if free.name == "K3")
    fit = fitted(model, windows_of(rig, model), (speed, stop))
    assert fit.interval(1) == pytest.approx((5e6, 2e7))
    assert fit.interval(0)[1] - fit.interval(0)[0] < 0.01 * rig["K3"]


def test_a_start_that_can_not_be_simulated_comes_back_with_infinite_squares(rig, model):
    windows = windows_of(rig, model)
    free = (FreeParameter("M", 1e-300, 1e-300, 1e-299, None, "nothing weighs that little"),)
    p = model.plant.parameter_values(M=1e-300)
    fit = fit_numbers(model, windows, free, np.zeros(1), p, model.starts(windows, model.plant.p), np.ones(4))
    assert not fit.ok


# --- the shape of an unknown


def test_a_shape_goes_with_the_signal_that_makes_it():
    random = np.random.default_rng(0)
    v, x = random.standard_normal((4, 400)), random.standard_normal((4, 400))
    found = shape("force", "N", np.maximum(v - 1, 0) + 0.05 * random.standard_normal(v.shape), {"x": x, "v": v}, 1e-3)
    assert [name for name, _ in found.explained] == ["v", "x"]
    assert found.explained[0][1] > 0.9
    assert abs(found.explained[1][1]) < 0.1
    assert np.interp([-1.0, 2.0], *found.curve.T) == pytest.approx([0.0, 1.0], abs=0.15)
    assert found.line is None


def test_a_shape_that_repeats_has_a_line():
    t = np.arange(500) * 1e-3
    random = np.random.default_rng(1)
    d = np.sin(2 * np.pi * 37 * t + np.array([[0.0], [1.0], [2.0]])) + 0.3 * random.standard_normal((3, 500))
    assert shape("flow", "l/min", d, {"t": np.tile(t, (3, 1))}, 1e-3).line == pytest.approx(37, abs=1)
