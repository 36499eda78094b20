"""Linear plants of the user's own: against python-control and analytic loops; laws on them; what is refused."""

import control
import numpy as np
import pytest

import workbench as wb
from controllers import AccelerationFeedback, LinearCrone, LinearCrone1, LinearLqg, LinearMpc, P, PidLead
from workbench.base.errors import InputError
from workbench.control.linear_model import LinearModel, sampled_model
from workbench.linear import as_state_space
from workbench.loop.reach import check_reach
from workbench.loop.rows import loop_setup
from workbench.plant import build
from workbench.rigs.rig_file import rig_text

CONTROL = '[limits]\nstroke = "300 mm"\n[control]\nperiod = "1 ms"\n'
SIGNALS = '[signals]\ncommand = 10.0\nposition = "mm"\ndelay = "1.5 ms"\n'
CHAIN = """[chain]
gain = 55.0
integrators = 1
lags = ["4 ms"]
modes = [{frequency = "18 Hz", damping = {value = 0.12, unit = "1"}}]
"""
W = 2 * np.pi * 18
DENOMINATOR = np.polymul(np.polymul([1, 0], [0.004, 1]), [1 / W**2, 2 * 0.12 / W, 1])
F = np.geomspace(0.1, 100, 30)


def plant_of(tmp_path, text, name="plant"):
    path = tmp_path / f"{name}.toml"
    path.write_text(text)
    return wb.load_rig(path)


def axis(system=None, **changes):
    system = control.tf([55.0], DENOMINATOR) if system is None else system
    words = {"period": "1 ms", "stroke": "300 mm", "command": 10.0, "position": "mm", "delay": "1.5 ms"}
    return wb.linear_plant(system, **{**words, **changes})


def transfer(f=F):
    """m per unit of command, without the delay."""
    s = 2j * np.pi * f
    return 0.55 / np.polyval(DENOMINATOR, s)


def response(plant, f=F):
    a, b, c, _ = plant.state_matrices()
    return np.array([(c @ np.linalg.solve(2j * np.pi * each * np.eye(len(a)) - a, b))[0, 0] for each in f])


def test_a_chain_a_transfer_function_and_matrices_are_one_plant(tmp_path):
    chain = plant_of(tmp_path, CHAIN + SIGNALS + CONTROL)
    np.testing.assert_allclose(response(chain), transfer(), rtol=1e-9)
    np.testing.assert_allclose(response(axis()), transfer(), rtol=1e-9)
    np.testing.assert_allclose(response(axis(control.ss(control.tf([55.0], DENOMINATOR)))), transfer(), rtol=1e-6)


def test_an_identified_model_is_taken_at_a_period_of_its_own():
    sampled = control.c2d(control.ss(control.tf([55.0], DENOMINATOR)), 5e-3)
    np.testing.assert_allclose(response(axis(sampled)), transfer(), rtol=1e-6)


def test_a_file_reads_back_as_the_plant_that_was_written(tmp_path):
    for given in (plant_of(tmp_path, CHAIN + SIGNALS + CONTROL + "[bounds]\ngain = [40, 60]\n"), axis(load="1e-4 1/N")):
        again = plant_of(tmp_path, rig_text(given), "again")
        np.testing.assert_allclose(response(again), response(given), rtol=1e-12)
        assert again.kind == given.kind
        assert [number.low for number in again.numbers.values()] == [n.low for n in given.numbers.values()]
        assert again.delay.value == given.delay.value


@pytest.mark.parametrize("ideal", [True, False])
def test_margins_are_those_of_python_control(ideal):
    plant = axis(computing_delay="0.4 ms")
    loop = wb.ClosedLoop(plant, P(gain=12.0), ideal=ideal)
    late = 1.5e-3 + (0.0 if ideal else 0.4e-3)
    f = np.geomspace(0.5, 100.0, 20_000)
    # python-control samples by a hundredth of the period, so that a delay is whole samples
    fine = control.ss(control.tf([0.55], DENOMINATOR))
    sampled = control.c2d(fine, 1e-5)
    a, b, c = (np.asarray(part) for part in (sampled.A, sampled.B, sampled.C))
    powers = [np.eye(len(a))]
    for _ in range(100):
        powers.append(powers[-1] @ a)
    held, part = divmod(round(late / 1e-5), 100)
    newer = sum(powers[i] for i in range(100 - part)) @ b
    older = powers[100 - part] @ sum((powers[i] for i in range(part)), start=np.zeros_like(a)) @ b
    z = np.exp(2j * np.pi * f * 1e-3)
    states = np.linalg.solve(z[:, None, None] * np.eye(len(a)) - powers[100], (newer + older / z[:, None, None]))
    open_loop = 12.0 * (c @ states)[:, 0, 0] * z**-held
    sensitivity = np.abs(1 / (1 + open_loop))
    margins = loop.margins().null
    assert margins.stable
    assert margins.ms == pytest.approx(sensitivity.max(), rel=1e-4)
    crossing = np.flatnonzero((np.abs(open_loop[:-1]) > 1) & (np.abs(open_loop[1:]) <= 1))[-1]
    phase = 180 + np.degrees(np.unwrap(np.angle(open_loop)))[crossing]
    assert margins.phase_margin_deg == pytest.approx(phase, abs=0.01)
    turning = np.unwrap(np.angle(open_loop)) + np.pi
    gain = np.abs(open_loop)[np.flatnonzero((turning[:-1] > 0) & (turning[1:] <= 0))].max()
    assert margins.gain_margin_db == pytest.approx(-20 * np.log10(gain), abs=0.01)


def test_a_step_is_that_of_the_sampled_loop():
    plant = axis(delay="2 ms")
    step = wb.ClosedLoop(plant, P(gain=12.0), ideal=True).step("5 mm", seconds="0.5 s")
    sampled = control.c2d(control.ss(control.tf([0.55], DENOMINATOR)), 1e-3)
    x, waiting, expected = np.zeros(len(sampled.A)), [0.0, 0.0], []
    for _ in step.t:
        expected.append((sampled.C @ x)[0])
        waiting.append(12.0 * (5e-3 - expected[-1]))
        x = sampled.A @ x + sampled.B[:, 0] * waiting.pop(0)
    np.testing.assert_allclose(step["position"], expected, atol=2e-7)


def test_a_first_order_plant_under_p_is_off_by_what_the_formula_says():
    plant = axis(control.tf([2.0], [0.1, 1.0]), command=1.0, delay=0.0)  # 2 mm per unit of command
    step = wb.ClosedLoop(plant, P(gain=100.0), ideal=True).step("1 mm", seconds="1 s")
    assert step["position"][-1] == pytest.approx(1e-3 * 0.2 / 1.2, rel=1e-4)


TYPE_0 = control.tf([2.0, 300.0], np.polymul([1.0, 17.0, 1127.0], [1.0, 28.5, 14.2]))
LAWS = {
    "pid-lead": PidLead(gain=60.0, integral_time="0.5 s"),
    "crone1": LinearCrone1(crossover="0.5 Hz", integral="0.3 Hz"),
    "crone2": LinearCrone(crossover="0.8 Hz", phase_margin="70 deg", roll_off="15 Hz"),
    "crone3": LinearCrone(crossover="0.8 Hz", phase_margin="70 deg", roll_off="15 Hz", imaginary=0.3),
    "lqg": LinearLqg(error="1 mm"),
    "lqg, a state pushed": LinearLqg(error="1 mm", disturbance=2.0),
    "mpc": LinearMpc(error="1 mm", stroke="50 mm", horizon="0.3 s"),
}


@pytest.mark.parametrize("law", LAWS)
def test_every_designer_takes_a_plant_that_does_not_integrate(law):
    plant = axis(TYPE_0, period="2 ms", stroke="50 mm", command=1000.0, delay="3 ms", load="1e-5 1/N")
    loop = wb.ClosedLoop(plant, LAWS[law], ideal=True)
    margins = loop.margins().null
    assert margins.stable
    assert margins.ms < 2.0
    run = loop.follow(wb.Scenario("pushed", "position", 1e-3, 12.0, load=500.0, load_at=3.0))
    assert run["position"][1400] == pytest.approx(1e-3, rel=0.25)
    assert run["position"][-1] == pytest.approx(1e-3, rel=2e-2)


@pytest.mark.parametrize("margin", [50.0, 70.0])
def test_crone_has_the_crossover_and_the_phase_margin_that_are_asked_for(margin):
    law = LinearCrone(crossover="4 Hz", phase_margin=f"{margin} deg", roll_off="40 Hz")
    plant = axis(computing_delay="0.2 ms")
    margins = wb.ClosedLoop(plant, law).margins().null
    assert margins.phase_margin_deg == pytest.approx(margin, abs=0.01)
    crossing = np.interp(-1.0, -np.abs(margins.open), margins.f)
    assert crossing == pytest.approx(4.0, rel=1e-3)


def test_poles_and_zeros_that_a_law_may_cancel_are_the_plants():
    model = LinearModel(axis(control.tf([1.0, 40.0], DENOMINATOR)), 1e-3)
    assert model.integrators == 1
    np.testing.assert_allclose(model.zeros, [-40.0], rtol=1e-6)
    expected = np.roots(DENOMINATOR)
    np.testing.assert_allclose(np.sort_complex(model.modes), np.sort_complex(expected[np.abs(expected) > 1]), rtol=1e-6)


def test_mpc_is_lqg_where_no_limit_is_near_and_slower_where_one_is():
    plant = axis(stroke="300 mm")
    lqg, mpc = LinearLqg(error="20 mm"), LinearMpc(error="20 mm", stroke="300 mm", speed="0.2 m/s", horizon="0.1 s")
    small = [wb.ClosedLoop(plant, law, ideal=True).step("2 mm", "0.3 s")["position"] for law in (lqg, mpc)]
    np.testing.assert_allclose(small[0], small[1], atol=1e-6)
    large = [wb.ClosedLoop(plant, law, ideal=True).step("150 mm", "1.5 s") for law in (lqg, mpc)]
    fastest = [np.abs(np.diff(run["position"])).max() / 1e-3 for run in large]
    assert fastest[0] > 0.4
    assert fastest[1] < 0.3  # what is beyond a limit of the plant has a price, that of the command is kept
    assert np.abs(large[1]["command"]).max() <= 1.0


def test_a_filter_on_the_position_finds_the_disturbance_on_a_state():
    plant = axis()
    controller = LinearLqg(error="20 mm", disturbance=2.0, disturbance_walk=1.0).knowing(plant).build(1e-3)
    law, model = controller.graph_law().matrices, sampled_model(plant, 1e-3)
    whole = np.block([[law.a, np.outer(law.b[:, 1], model.C[0])], [np.zeros((len(model.A), len(law.a))), model.A]])
    whole[: len(law.a)] += np.outer(law.e, np.append(law.c, law.d[1] * model.C[0]))
    whole[len(law.a) :] += np.outer(model.B[:, 0], np.append(law.c, law.d[1] * model.C[0]))
    assert np.abs(np.linalg.eigvals(whole)).max() < 1


def test_perturbed_plants_run_in_lanes(tmp_path):
    from workbench.loop.envelope import envelope, steps

    plant = plant_of(tmp_path, CHAIN + SIGNALS + CONTROL)
    soft = plant.with_values(mode_1_frequency=14.0)
    lanes = envelope({"nominal": plant, "soft": soft}).varied
    assert lanes.names == ("nominal", "soft")
    law = PidLead(gain=12.0, integral_time="10 s").build(1e-3)
    null, _ = lanes.margins(law)
    alone = [wb.ClosedLoop(each, PidLead(gain=12.0, integral_time="10 s"), ideal=True) for each in (plant, soft)]
    np.testing.assert_allclose(null.ms, [loop.margins().null.ms for loop in alone], rtol=1e-3)
    together = steps(lanes, law, wb.SCENARIOS["position-10mm"], None, 1.0)
    apart = [loop.step("10 mm", "1 s").metrics["overshoot_percent"] for loop in alone]
    np.testing.assert_allclose(together.overshoot, apart, atol=1e-3)


def test_a_plant_keeps_its_delay_apart_from_the_computing_delay():
    setup = loop_setup(wb.with_delay(axis(), 4e-4))
    assert setup.engine.plant.lateness() == pytest.approx(1.9e-3)
    assert build(axis()).lateness() == pytest.approx(1.5e-3)


REFUSED = {
    "[transfer_function]\nnumerator = [1, 2]\ndenominator = [1, 3]\n": "must be of lower order than the denominator",
    "[transfer_function]\nnumerator = [1]\ndenominator = [0, 3]\n": "begins with 0",
    "[state_space]\nA = [[0, 1]]\nB = [[0], [1]]\nC = [[1, 0]]\n": "it must be square",
    "[state_space]\nA = [[-1]]\nB = [[1], [2]]\nC = [[1]]\n": "has 2 rows; A and outputs ask for 1",
    "[state_space]\nA = [[-1]]\nB = [[1]]\nC = [[1]]\nD = [[1]]\n": "must be 0: what is measured cannot answer at once",
    "[state_space]\nperiod = '1 ms'\nA = [[-0.5]]\nB = [[1]]\nC = [[1]]\n": "has a negative real pole z",
    "[state_space]\nperiod = '1 ms'\nA = [[0.0]]\nB = [[1]]\nC = [[1]]\n": "which is a delay",
    "[chain]\ngain = 2\n": "has no part",
    "[chain]\nintegrators = 1\n[transfer_function]\nnumerator = [1]\ndenominator = [1, 1]\n": "written in one way",
    "[chain]\nintegrators = 1\n[bounds]\ngain = [2, 3]\n": "must be [low, high] about its value of 1",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_plant_is_refused_in_one_line(tmp_path, text):
    with pytest.raises(InputError) as refused:
        plant_of(tmp_path, text + CONTROL)
    assert REFUSED[text] in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_a_plant_cannot_do_is_refused():
    plant = axis()
    for name, words in (("load-20kn", "no force acts on plant"), ("10mm-at+90", "the same everywhere")):
        with pytest.raises(InputError, match=words):
            check_reach(wb.SCENARIOS[f"position-{name}"], plant)
    with pytest.raises(InputError, match="has 4 states, no state 9"):
        wb.ClosedLoop(plant, LinearLqg(disturbance=9.0))
    with pytest.raises(InputError, match="is designed on a linear plant"):
        wb.ClosedLoop(wb.load_rig("jack-10t"), LinearLqg())
    with pytest.raises(InputError, match="has no acceleration sensor"):
        wb.ClosedLoop(plant, P(gain=5.0) + AccelerationFeedback(gain=1e-3))
    with pytest.raises(InputError, match="one input, the command"):
        axis(control.ss(np.eye(2) * -1, np.eye(2), np.eye(2), np.zeros((2, 2))))


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (control.tf([0.1], [1.0, -1.0], True), "dt=True, which is no period"),
        (control.ss([[1.0]], [[0.1]], [[1.0]], [[0.0]], True), "dt=True, which is no period"),
        (control.frd([1.0, 0.5j], [1.0, 2.0]), "no FrequencyResponseData"),
        (control.nlsys(lambda t, x, u, _: u - x, None, inputs=1, outputs=1, states=1), "no NonlinearIOSystem"),
        (lambda s: 1 / s, "no function"),
    ],
)
def test_a_system_that_is_no_linear_model_is_refused(system, words):
    with pytest.raises(InputError, match=words):
        axis(system)
    if not isinstance(system, control.TransferFunction):
        with pytest.raises(InputError, match=r"dt=True|is no state space"):
            as_state_space(system)


def test_names_in_messages_are_the_files(tmp_path):
    with pytest.raises(InputError, match=r"plant\.toml: line 2: chain\.lag: unknown key"):
        plant_of(tmp_path, '[chain]\nlag = "1 ms"\n' + CONTROL)
