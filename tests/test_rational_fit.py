"""A model with delay fitted to a frequency response: the true one out of noise; as a plant; what is refused."""

import numpy as np
import pytest

import workbench as wb
from workbench.base.errors import InputError
from workbench.base.rational_function import fit_rational_function
from workbench.commands.common.experiment import rig_name, rig_of
from workbench.commands.common.experiment_file import read_experiment
from workbench.records.rational_fit import FitOrder, fit_rational
from workbench.rigs.rig_file import rig_text

F = np.geomspace(0.2, 60, 45)
S = 2j * np.pi * F


def mode(hz, zeta):
    w = 2 * np.pi * hz
    return [1 / w**2, 2 * zeta / w, 1.0]


def product(*parts):
    whole = np.ones(1)
    for part in parts:
        whole = np.polymul(whole, part)
    return whole


SYSTEMS = {
    "integrator, lag and mode": ([55.0], product([1, 0], [0.004, 1], mode(18, 0.12)), 1.5e-3),
    "type 0": ([2.0, 300.0], product([1, 17, 1127], [1, 28.5, 14.2]), 3e-3),
    "integrator and two modes": ([0.3], product([1, 0], mode(12, 0.05), mode(35, 0.03)), 2e-3),
    "integrator and delay": ([2.0], [1.0, 0.0], 5e-3),
    "resonance between zeros": (3 * product(mode(8, 0.01)), product([0.05, 1], mode(11, 0.02), [0.002, 1]), 0.0),
    "double integrator": ([4.0], product([1, 0, 0], [0.01, 1]), 1e-3),
}


def response(system, noise=0.0):
    top, bottom, delay = system
    random = np.random.default_rng(0)
    error = noise * (random.normal(size=len(F)) + 1j * random.normal(size=len(F))) / np.sqrt(2)
    return np.polyval(top, S) / np.polyval(bottom, S) * np.exp(-S * delay) * (1 + error)


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_order_delay_and_poles_are_found(name, noise):
    top, bottom, delay = SYSTEMS[name]
    fit = fit_rational(F, response(SYSTEMS[name], noise))
    assert (len(fit.numerator), len(fit.denominator)) == (len(top), len(bottom))
    assert fit.delay == pytest.approx(delay, abs=1e-4 if noise else 1e-8)
    clean = response(SYSTEMS[name])
    assert np.abs(fit.fitted / clean - 1).max() < (0.03 if noise else 1e-6)
    assert fit.error < (1.2 * noise if noise else 1e-6)


@pytest.mark.parametrize("name", ["integrator and two modes", "integrator, lag and mode", "resonance between zeros"])
def test_a_noisy_response_is_fitted_to_what_lies_behind_it(name):
    """Poles found by weights that noise pulls along would leave 60 to 100 %."""
    top, bottom, delay = SYSTEMS[name]
    clean, integrators = response(SYSTEMS[name]), int(bottom[-1] == 0)
    for seed in (1, 2):
        noise = np.random.default_rng(seed).normal(size=(2, len(F)))
        order = FitOrder(len(bottom) - 1, len(np.atleast_1d(top)) - 1, integrators, delay)
        fit = fit_rational(F, clean * (1 + 0.1 * (noise[0] + 1j * noise[1]) / np.sqrt(2)), order)
        assert np.sqrt(np.mean(np.abs(fit.fitted / clean - 1) ** 2)) < 0.05


def test_a_rational_function_of_high_degree_over_many_decades_is_found():
    """Twelve decades of powers of x: their columns are as good as dependent, orthonormal ones are not."""
    x = 1j * np.geomspace(1e-3, 1e3, 300)
    poles, zeros = -np.geomspace(2e-3, 500, 12), -np.geomspace(3e-3, 700, 11)
    wanted = np.prod(x[:, None] - zeros, axis=1) / np.prod(x[:, None] - poles, axis=1)
    found = fit_rational_function(x, wanted, 11, 12)
    assert found.error < 1e-10
    assert np.sort(found.poles.real) == pytest.approx(np.sort(poles), rel=1e-4)
    assert found.gain == pytest.approx(1.0, rel=1e-4)


def test_mirrored_poles_are_left_of_the_axis_and_others_are_where_they_are():
    x = 1j * np.geomspace(0.1, 10, 40)
    unstable = 3 / ((x - 1) * (x**2 + 0.2 * x + 4))
    free, mirrored = (fit_rational_function(x, unstable, 0, 3, mirrored=way) for way in (False, True))
    assert free.poles.real.max() == pytest.approx(1.0)
    assert mirrored.poles.real.max() < 0
    assert free.error < 1e-12 < mirrored.error


def test_an_order_and_a_delay_that_are_given_are_kept():
    known = FitOrder(poles=4, zeros=1, integrators=1, delay=1e-3)
    fit = fit_rational(F, response(SYSTEMS["integrator, lag and mode"], 0.02), known)
    assert (len(fit.numerator), len(fit.denominator), fit.delay) == (2, 5, 1e-3)
    assert fit.denominator[-1] == 0.0


def test_an_unstable_pole_is_found_where_it_is_allowed_only():
    unstable = response(([40.0], product([1, -3.0], [0.02, 1]), 1e-3), 0.02)
    assert not fit_rational(F, unstable).unstable.size
    fit = fit_rational(F, unstable, FitOrder(stable=False))
    np.testing.assert_allclose(fit.unstable, [3.0], rtol=0.02)


SHEET = "frequency [Hz],gain [{}],phase [deg]\n"
REST = """
signals = {command = 10.0, position = "mm"}
limits = {stroke = "300 mm"}
control = {period = "1 ms"}
"""


def write_sheet(path, values, unit="mm/V", scale=1.0):
    rows = [f"{f:.6g},{abs(g) * scale:.8g},{np.degrees(np.angle(g)):.7g}" for f, g in zip(F, values, strict=True)]
    path.write_text(SHEET.format(unit) + "\n".join(rows) + "\n")


def plant_of(tmp_path, plant):
    path = tmp_path / "experiment.toml"
    path.write_text(f"[plant]\n{plant}\n{REST}")
    return rig_of(read_experiment(path), path, None)


@pytest.mark.parametrize(("unit", "scale"), [("mm/V", 1.0), ("um", 1e3), ("1", 1.0)])
def test_a_sheet_is_the_plant_of_an_experiment_in_its_own_units(tmp_path, unit, scale):
    write_sheet(tmp_path / "axis.csv", response(SYSTEMS["integrator, lag and mode"]), unit, scale)
    plant = plant_of(tmp_path, 'frequency_response = "axis.csv"')
    a, b, c, _ = plant.state_matrices()
    fitted = np.array([(c @ np.linalg.solve(s * np.eye(4) - a, b))[0, 0] for s in S]) * np.exp(-S * plant.delay.value)
    np.testing.assert_allclose(fitted, 10.0 * 1e-3 * response(SYSTEMS["integrator, lag and mode"]), rtol=1e-4)


def test_a_sheet_in_a_plants_file_is_that_plant_and_is_written_as_its_transfer_function(tmp_path):
    write_sheet(tmp_path / "axis.csv", response(SYSTEMS["type 0"], 0.02))
    file = tmp_path / "axis.toml"
    file.write_text(
        '[frequency_response]\nfile = "axis.csv"\npoles = 4\nzeros = 1\n[signals]\nposition = "mm"\n'
        '[limits]\nstroke = "300 mm"\n[control]\nperiod = "1 ms"\n'
    )
    plant = wb.load_rig(file)
    assert "4 poles (0 at 0), 1 zero," in plant.source
    (tmp_path / "again.toml").write_text(rig_text(plant))
    again = wb.load_rig(tmp_path / "again.toml")
    for mine, theirs in zip(plant.state_matrices(), again.state_matrices(), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-12)
    assert again.delay.value == pytest.approx(plant.delay.value, rel=1e-12)


REFUSED = {
    'frequency_response = "other.csv"': "no such file as",
    'frequency_response = {file = "axis.csv", poles = 2}': "farther off than largest_error, 10 %; give more poles",
    'frequency_response = {file = "axis.csv", largest_error = "0.1 %"}': "farther off than largest_error, 0.1 %; cut",
    'frequency_response = {file = "axis.csv", poles = 3, zeros = 3}': "3 zeros: must be fewer than the poles",
    'frequency_response = {file = "axis.csv", poles = 40}': "40 poles of 45 frequencies: must be 1 to 8",
    'frequency_response = {file = "unstable.csv"}': "the plant is unstable: write unstable = true",
    'frequency_response = {file = "force.csv"}': "write dB, 1, or mm over the input",
}


@pytest.mark.parametrize("plant", REFUSED)
def test_what_is_no_plant_is_refused_in_one_line(tmp_path, plant):
    write_sheet(tmp_path / "axis.csv", response(SYSTEMS["integrator, lag and mode"], 0.02))
    write_sheet(tmp_path / "force.csv", response(SYSTEMS["integrator, lag and mode"]), "kN")
    write_sheet(tmp_path / "unstable.csv", response(([40.0], product([1, -3.0], [0.02, 1]), 1e-3)))
    with pytest.raises(InputError) as refused:
        plant_of(tmp_path, plant)
    assert REFUSED[plant] in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_experiments_rig_is_named_by_its_sheet(tmp_path):
    path = tmp_path / "experiment.toml"
    path.write_text('[plant]\nfrequency_response = {file = "axis.csv", poles = 4}\n')
    assert rig_name(read_experiment(path)).endswith("axis.csv")
