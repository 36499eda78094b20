"""CRONE designs: what they promise on the jack's model, on the damped jack itself, and beside PID + lead."""

import json
import re
from dataclasses import asdict, replace
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from controllers.crone1 import Crone1
from controllers.crone2 import Crone2
from controllers.pid_lead import PidLead
from controllers.pressure import PressureFeedback
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.step_experiment import StepConfig
from workbench.commands.run.options import load_config
from workbench.control.inner_loop import inner_loop_closed, overshoots
from workbench.control.jack_model import fit_jack_model
from workbench.linear import discretise
from workbench.linear.state_space import sampled_response
from workbench.loop.overshoots import overshoot_spread, spread as spread_of

PERIOD = 1e-3
EXPERIMENT = Path(__file__).parents[1] / "experiments" / "position_crone.toml"
GAINS = 2.0 ** np.linspace(-1, 1, 9)
PRESSURE = PressureFeedback(PressureFeedback.Design(gain=2e-9, corner=1.0), PERIOD)


@pytest.fixture(scope="module")
def jack(plant, moving):
    """The pressure-damped jack, moving at 0.1 m/s."""
    return inner_loop_closed(plant, moving, PERIOD, [PRESSURE])


@pytest.fixture(scope="module")
def model(jack):
    return asdict(fit_jack_model(jack))


def response(system, f):
    return sampled_response(system, np.exp(2j * np.pi * np.asarray(f) * PERIOD))[0, 0]


def loop(jack, controller, f):
    return response(jack, f) * response(controller.linear(), f)


def lead(gain, turn, w):
    """PID + lead without derivative: a textbook lead that turns the phase by `turn` [rad] at w."""
    ratio = (1 + np.sin(turn)) / (1 - np.sin(turn))
    times = {"integral_time": 100.0, "lead_time": np.sqrt(ratio) / w, "lead_ratio": ratio}
    return PidLead(PidLead.Design(gain=gain, **times), PERIOD)


def pid(gain, turn, w):
    """PID + lead without lead: Ti = 4 Td, the double zero of the textbooks (Åström and Hägglund, 2006, sec. 6.2)."""
    time = np.exp(turn) / w
    return PidLead(PidLead.Design(gain=gain, integral_time=4 * time, derivative_time=time), PERIOD)


def pi(gain, turn, w):
    """PID + lead without both, for a jack that has more margin than is asked for."""
    return PidLead(PidLead.Design(gain=gain, integral_time=np.exp(turn) / w), PERIOD)


def matched(shape, jack, crossover, margin, low, high):
    """The PID + lead of a shape with this crossover [Hz] and phase margin [rad] on the jack."""
    w, there = 2 * np.pi * crossover, response(jack, [crossover])[0]

    def seen(turn):
        return there * response(shape(1.0, turn, w).linear(), [crossover])[0]

    turn = brentq(lambda turn: np.angle(-np.exp(-1j * margin) * seen(turn)), low, high)
    return shape(1 / abs(seen(turn)), turn, w)


def spread(jack, controller):
    """Between the largest and the least overshoot over the gains [percent of the step]; without end for instability."""
    found = overshoots(jack, controller.linear(), GAINS)
    return np.inf if None in found else max(found) - min(found)


@pytest.mark.parametrize("speed", ["rest", "moving"])
@pytest.mark.parametrize("compensated", [True, False])
def test_six_numbers_are_the_jack(request, plant, speed, compensated):
    """Within 0.3 dB and 2 degrees to 40 Hz, damped or not; undamped, its mode is the jack's own."""
    about = request.getfixturevalue(speed)
    jack = inner_loop_closed(plant, about, PERIOD, [PRESSURE]) if compensated else discretise(plant, about, PERIOD)
    found = fit_jack_model(jack)
    f = np.geomspace(0.3, 40, 40)
    ratio = found.response(f) / response(jack, f)
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.3
    assert np.abs(np.degrees(np.angle(ratio))).max() < 2
    if not compensated:
        assert found.jack_frequency == pytest.approx(27.4, rel=0.01)


def test_a_model_sampled_is_its_response(model, jack):
    found = fit_jack_model(jack)
    f = np.geomspace(0.3, 100, 40)
    assert response(found.discretise(PERIOD), f) == pytest.approx(found.response(f), rel=0.03)


@pytest.mark.parametrize("kind", [Crone1, Crone2])
@pytest.mark.parametrize("integral", [0.0, 0.2])
@pytest.mark.parametrize(("crossover", "margin"), [(2.0, 60), (5.0, 50), (5.0, 70), (8.0, 65)])
def test_it_has_its_crossover_and_its_margin(jack, model, kind, integral, crossover, margin):
    """On the damped jack itself, not only on its model: 1 % and 1 degree."""
    design = kind.Design(**model, crossover=crossover, phase_margin=np.radians(margin), integral=integral)
    at = loop(jack, kind(design, PERIOD), [crossover])[0]
    assert abs(at) == pytest.approx(1, rel=0.01)
    assert np.degrees(np.angle(-at)) == pytest.approx(margin, abs=1)


@pytest.mark.parametrize(("crossover", "margin"), [(2.0, 60), (5.0, 50), (5.0, 70), (8.0, 60)])
def test_the_phase_of_crone2_is_constant_about_the_crossover(jack, model, crossover, margin):
    """Within 4 degrees over two octaves, where the jack's own phase turns by 13 to 40."""
    controller = Crone2(Crone2.Design(**model, crossover=crossover, phase_margin=np.radians(margin)), PERIOD)
    f = crossover * 2.0 ** np.linspace(-1, 1, 21)
    assert np.degrees(np.angle(-loop(jack, controller, f))) == pytest.approx(margin, abs=4)
    assert np.ptp(np.degrees(np.angle(loop(jack, controller, f)))) < 0.6 * np.ptp(
        np.degrees(np.angle(response(jack, f)))
    )


@pytest.mark.parametrize(
    ("shape", "ends", "crossover", "margin"),
    [
        (pi, (-3, 6), 4.0, 65),
        (pi, (-3, 6), 6.0, 70),
        (pid, (-4, 2), 4.0, 60),
        (pid, (-4, 2), 6.0, 55),
        (lead, (1e-6, 1.28), 8.0, 75),
    ],
)
def test_crone_keeps_its_overshoot_where_pid_lead_does_not(jack, model, shape, ends, crossover, margin):
    """Same crossover, same margin, same damped jack, gain x0.5 to x2: the spread is at most half of PID + lead's."""
    goal = crossover, np.radians(margin)
    crone = Crone2(Crone2.Design(**model, crossover=goal[0], phase_margin=goal[1]), PERIOD)
    other = matched(shape, jack, *goal, *ends)
    assert np.degrees(np.angle(-loop(jack, other, [crossover])[0])) == pytest.approx(margin, abs=0.1)
    assert spread(jack, crone) <= 0.5 * spread(jack, other)
    assert spread(jack, crone) <= 6


@pytest.mark.parametrize(
    ("kind", "goal", "message"),
    [
        (Crone1, (20.0, 110), "a phase margin of 110 deg at 20 Hz is out of reach: "),
        (Crone2, (100.0, 110), "a phase margin of 110 deg at 100 Hz is out of reach: "),
    ],
)
def test_what_is_out_of_reach_is_said_in_one_line(model, kind, goal, message):
    design = kind.Design(**model, crossover=goal[0], phase_margin=np.radians(goal[1]))
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        kind(design, PERIOD)
    assert "\n" not in str(caught.value)


def test_a_sharp_mode_makes_crone1_unstable_and_says_so(model):
    design = Crone1.Design(**model | {"jack_damping": 0.02}, crossover=5.0, phase_margin=1.0)
    with pytest.raises(InputError, match="a loop with this phase at 5 Hz is unstable; lower the crossover"):
        Crone1(design, PERIOD)


def test_a_jack_that_does_not_integrate_has_no_six_numbers(jack):
    held = control.feedback(jack.to_control(), 50.0)
    with pytest.raises(InputError, match="dB off"):
        fit_jack_model(held)


def test_an_unstable_gain_has_no_overshoot(jack, model):
    controller = Crone2(Crone2.Design(**model, crossover=5.0, phase_margin=1.0), PERIOD)
    assert overshoots(jack, controller.linear(), [20.0]) == [None]


@pytest.fixture(scope="module")
def shipped():
    config = load_config(EXPERIMENT)
    assert isinstance(config, StepConfig)
    return config.rig, {chosen.name: chosen for chosen in config.controllers}


def test_the_shipped_designs_have_one_crossover_and_one_margin(shipped, jack):
    for name in ("pid-lead", "crone1", "crone2"):
        at = loop(jack, replace(shipped[1][name], compensators=()).build(PERIOD), [6.0])[0]
        assert abs(at) == pytest.approx(1, rel=0.01)
        assert np.degrees(np.angle(-at)) == pytest.approx(70, abs=0.5)


def test_the_shipped_spreads(shipped):
    """Over gain and oil at most half of PID + lead's. Not over mass, which moves the mode that crone2 cancels."""
    rig, chosen = shipped
    crone, other = (overshoot_spread(rig, chosen[name]) for name in ("crone2", "pid-lead"))
    for what in ("gain", "speed", "beta"):
        assert spread_of(crone[what]) <= 0.5 * spread_of(other[what])
    assert crone["gain"]["x1"] == crone["speed"]["0.1 m/s"] == crone["M"]["x1"] == pytest.approx(7.5, abs=1)
    assert spread_of(other["M"]) < spread_of(crone["M"]) < 2


def test_a_spread_with_an_unstable_loop_is_none():
    assert spread_of({"x1": 3.0, "x2": 10.0}) == 7.0
    assert spread_of({"x1": 3.0, "x2": None}) is None


def test_a_spread_of_a_law_that_measures_more_is_refused(shipped):
    with pytest.raises(InputError, match="lqg: measures position, pa, pb"):
        overshoot_spread(shipped[0], shipped[1]["lqg"])


def test_the_command_of_the_readme_leaves_out_what_is_no_position_law_and_says_so(capsys):
    assert main(["spread", str(EXPERIMENT), "--json"]) == 0
    said = capsys.readouterr()
    assert list(json.loads(said.out)) == ["p-dp", "pid-lead", "crone1", "crone2"]
    assert said.err == "left out: lqg; a spread needs position laws\n"
    assert main(["spread", str(EXPERIMENT), "--controller", "lqg"]) == 2
    assert "lqg: measures position, pa, pb" in capsys.readouterr().err
