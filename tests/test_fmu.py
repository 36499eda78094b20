"""FMUs of a small rig and of a loop on it: FMPy finds them valid, and they move as the engine and the loop do."""

import shutil
from dataclasses import replace
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np
import pytest
from made_experiments import P_DP

from workbench.base.units import base_units
from workbench.cli import main
from workbench.commands.common.step_experiment import load_steps
from workbench.commands.fmu.model import with_cavitation
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import Variable, build
from workbench.rigs.rig_file import load_rig

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: the group fmu")
needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
pytestmark = pytest.mark.filterwarnings("default")  # those of FMPy are its own

RIG = "festo-tp511"
PERIOD = 1e-3
STEPS = f"""
experiment = "step"
rig = "{RIG}"
scenarios = ["position-10mm"]
{P_DP}
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


class Slave:
    """An FMU in co-simulation, with values by name."""

    def __init__(self, path, folder, **parameters):
        from fmpy.fmi2 import FMU2Slave

        description = fmpy.read_model_description(path)
        self.places = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(path, folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="jack",
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.set(**parameters)
        self.fmu.exitInitializationMode()

    def set(self, **values):
        self.fmu.setReal([self.places[name] for name in values], list(values.values()))

    def get(self, *names):
        return np.array(self.fmu.getReal([self.places[name] for name in names]))

    def along(self, unknown, known):
        """d unknown / d known, [unknown, known]."""
        rows = [self.places[name] for name in unknown]
        columns = [self.fmu.getDirectionalDerivative(rows, [self.places[name]], [1.0]) for name in known]
        return np.array(columns).T


def exported(folder, *words):
    """The file that the command leaves."""
    assert main(["fmu", RIG, "--out", str(folder / "made"), *words]) == 0
    (path,) = (folder / "made").iterdir()
    return path


@pytest.fixture(scope="module")
def plant_fmu(tmp_path_factory):
    return exported(tmp_path_factory.mktemp("plant"))


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    path = tmp_path_factory.mktemp("steps") / "steps.toml"
    path.write_text(STEPS)
    return path


@pytest.fixture(scope="module")
def loop_fmu(tmp_path_factory, steps):
    return exported(tmp_path_factory.mktemp("loop"), "--controller", f"{steps}:p-dp")


def moves(plant, about, samples=200):
    """Inputs [samples, m]: a command and a disturbance in steps."""
    u = np.tile(about.u, (samples, 1))
    u[20:, plant.input("command")] = 0.3
    u[120:, plant.input("command")] = -0.2
    u[70:, plant.input("disturbance")] = 100.0
    return u


@needs_compiler
def test_fmpy_finds_both_valid(plant_fmu, loop_fmu):
    from fmpy.validation import validate_fmu

    assert validate_fmu(plant_fmu) == validate_fmu(loop_fmu) == []


@needs_compiler
@pytest.mark.parametrize("mass", [1.0, 1.3])
def test_co_simulation_is_the_engine_s(plant_fmu, tmp_path, mass):
    plant = build(load_rig(RIG))
    about, p = equilibrium(plant), plant.parameter_values(M=mass * plant.p[plant.parameters.index("M")])
    plant, start = with_cavitation(plant, about.x)
    u = moves(plant, about)
    expected = Engine(plant).run(start, np.arange(len(u) + 1) * PERIOD, u, p).x
    slave = Slave(plant_fmu, tmp_path, M=p[plant.parameters.index("M")])
    names = [state.name for state in (*plant.states[:-1], Variable("state.cavitation_s", "s", 1.0))]
    x = [slave.get(*names)]
    for k, row in enumerate(u):
        slave.set(**dict(zip((variable.name for variable in plant.inputs), row, strict=True)))
        slave.fmu.doStep(k * PERIOD, PERIOD)
        x.append(slave.get(*names))
    assert np.all(np.abs(np.array(x) - expected) <= 1e-6 * np.ptp(expected, axis=0))
    outputs = plant.observe(expected[-1], u[-1], p)[0]
    assert slave.get(*plant.outputs) == pytest.approx(outputs, rel=1e-6, abs=1e-6 * np.abs(outputs).max())


@needs_compiler
def test_derivatives_are_the_plant_s(plant_fmu, tmp_path):
    plant, slave = build(load_rig(RIG)), Slave(plant_fmu, tmp_path)
    about = equilibrium(plant)
    states, inputs = ([variable.name for variable in part] for part in (plant.states, plant.inputs))
    a, b, c, d = (np.array(slope) for slope in plant.slopes(about.x, about.u, plant.p))
    rates = [f"der({name})" for name in states]
    expected = np.block([[a, b], [c, d]])
    slopes = slave.along([*rates, *plant.outputs], [*states, *inputs])
    np.testing.assert_allclose(slopes, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert slave.get(*rates) == pytest.approx(np.array(plant.f(about.x, about.u, plant.p)).ravel())


@needs_compiler
def test_model_exchange_by_cvode_follows_the_engine(plant_fmu):
    plant = build(load_rig(RIG))
    about = equilibrium(plant)
    u = moves(plant, about)
    t = np.arange(len(u) + 1) * PERIOD
    expected = Engine(plant, tolerance=1e-8).run(about.x, t, u).x
    names = [variable.name for variable in plant.inputs]
    rows = [(t[k + more], *u[k]) for k in range(len(u)) for more in (0, 1)]  # two at every time where an input steps
    given = np.array(rows, dtype=[(name, float) for name in ("time", *names)])
    states = [state.name for state in plant.states]
    result = fmpy.simulate_fmu(
        plant_fmu, fmi_type="ModelExchange", stop_time=t[-1], relative_tolerance=1e-8, output_interval=PERIOD,
        input=given, output=states,
    )  # fmt: skip
    for i, name in enumerate(states):
        assert np.interp(t, result["time"], result[name]) == pytest.approx(
            expected[:, i], abs=1e-5 * np.ptp(expected[:, i])
        )


@needs_compiler
@pytest.mark.parametrize(("size", "tripped"), [(0.01, False), (0.5, True)])
def test_a_loop_inside_is_the_sampled_loop_however_long_the_steps_are(loop_fmu, steps, tmp_path, size, tripped):
    """The command arrives 0.3 ms late, inside a period; a step beyond the stroke makes the guard trip."""
    config = load_steps(steps)
    rig = with_delay(config.rig, config.conditions.delay(config.controllers[0], config.rig))
    bare = build(rig)
    rest, reference = equilibrium(bare), np.where(np.arange(1000) < 20, 0.0, size)
    plant, start = with_cavitation(bare, rest.x)
    loop = SampledLoop(Engine(plant), rig, config.controllers[0].build(PERIOD), replace(rest, x=start))
    played = loop.run(reference)
    run = played.record.signals
    assert (played.tripped is not None) == tripped
    for periods in (1, 5):
        slave, trip = Slave(loop_fmu, tmp_path / str(periods)), 0.0
        for k in range(0, len(reference), periods):
            position, pressure = slave.get("position", "pa")
            assert position == pytest.approx(run["position"][k], abs=1e-6 * size)
            assert pressure == pytest.approx(run["pa"][k], abs=1e-6 * np.ptp(run["pa"]))
            slave.set(reference=reference[k])
            slave.fmu.doStep(k * PERIOD, periods * PERIOD)
            sent, trip = slave.get("sent", "trip")
            assert sent == pytest.approx(run["command"][k + periods - 1], abs=1e-6)
        assert (trip > 0) == tripped


@needs_compiler
def test_the_loop_inside_samples_by_time_events_in_model_exchange(loop_fmu):
    given = np.array(
        [(0.0, 0.0), (0.02, 0.0), (0.02, 0.01), (0.2, 0.01)], dtype=[("time", float), ("reference", float)]
    )
    results = [
        fmpy.simulate_fmu(
            loop_fmu, fmi_type=kind, stop_time=0.2, relative_tolerance=1e-8, output_interval=PERIOD, input=given,
            output=["position"],
        )
        for kind in ("CoSimulation", "ModelExchange")
    ]  # fmt: skip
    there, here = (np.interp(np.arange(200) * PERIOD, each["time"], each["position"]) for each in results)
    assert there == pytest.approx(here, abs=1e-4 * 0.01)
    assert np.ptp(there) > 0.005


@needs_compiler
def test_a_state_is_kept_and_taken_up_again(loop_fmu, tmp_path):
    slave = Slave(loop_fmu, tmp_path)
    slave.set(reference=0.01)
    kept = None
    ends = []
    for turn in range(2):
        for k in range(20, 40) if turn else range(40):
            if k == 20 and not turn:
                kept = slave.fmu.getFMUState()
            slave.fmu.doStep(k * PERIOD, PERIOD)
        ends.append(slave.get("position", "pa", "sent"))
        slave.fmu.setFMUState(kept)
    assert ends[0].tolist() == ends[1].tolist()


@needs_compiler
def test_the_description_has_units_meanings_and_start_values(plant_fmu):
    with ZipFile(plant_fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    (mass,) = root.iterfind(".//ScalarVariable[@name='M']")
    assert (mass.attrib["causality"], mass.attrib["description"]) == ("parameter", load_rig(RIG).specs["M"].meaning)
    assert mass[0].attrib == {"unit": "kg", "start": repr(load_rig(RIG)["M"])}
    (newton,) = root.iterfind(".//Unit[@name='N']/BaseUnit")
    assert newton.attrib == {"kg": "1", "m": "1", "s": "-2", "factor": "1.0"}
    factor, powers = base_units("bar")
    assert (factor, powers) == (pytest.approx(1e5), {"kilogram": 1, "meter": -1, "second": -2})


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--controller", "steps.toml"], "name an experiment and its controller, FILE:NAME"),
        (["--controller", "steps.toml:pid"], "no controller pid; it has p-dp"),
        (["--out", "there"], "there: exists already"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steps.toml").write_text(STEPS)
    (tmp_path / "there").mkdir()
    assert main(["fmu", RIG, *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_without_a_compiler_it_is_refused_in_one_line(monkeypatch, capsys):
    monkeypatch.setenv("PATH", "/nowhere")
    assert main(["fmu", RIG]) == 2
    assert "no cc, gcc or clang here; install a C compiler" in capsys.readouterr().err


def refusals(slave, *calls):
    """Whether every one of these calls is refused, and nothing moves."""
    from fmpy.fmi1 import FMICallException

    before = slave.get("position", "pa", "M").tolist()
    for call in calls:
        with pytest.raises(FMICallException, match="status 3"):
            call()
    return slave.get("position", "pa", "M").tolist() == before


@needs_compiler
def test_steps_that_fmi_forbids_are_refused_and_move_nothing(plant_fmu, tmp_path):
    slave = Slave(plant_fmu, tmp_path)
    step = slave.fmu.doStep
    slave.set(command=0.3)
    step(0.0, PERIOD)
    gaps = [lambda: step(3 * PERIOD, PERIOD), lambda: step(0.0, PERIOD)]
    lengths = [lambda length=length: step(PERIOD, length) for length in (-PERIOD, 0.0, np.nan, np.inf)]
    assert refusals(slave, *gaps, *lengths)
    step(PERIOD, PERIOD)  # a refused call ends nothing
    assert refusals(slave, lambda: slave.set(M=1.0), lambda: slave.set(x=0.01), lambda: slave.set(command=np.nan))
    assert refusals(slave, slave.fmu.enterInitializationMode, slave.fmu.exitInitializationMode)
    slave.fmu.terminate()
    assert refusals(slave, lambda: step(2 * PERIOD, PERIOD), lambda: slave.set(command=0.0), slave.fmu.terminate)
    slave.fmu.reset()
    assert refusals(slave, lambda: step(0.0, PERIOD), slave.fmu.exitInitializationMode, slave.fmu.terminate)
    slave.fmu.setupExperiment(startTime=1.0, stopTime=1.0 + 2 * PERIOD)
    slave.set(M=20.0)
    slave.fmu.enterInitializationMode()
    assert refusals(slave, lambda: step(1.0, PERIOD), lambda: slave.fmu.setupExperiment(startTime=0.0))
    slave.set(M=21.0)
    slave.fmu.exitInitializationMode()
    assert refusals(slave, lambda: step(0.0, PERIOD), lambda: step(1.0, 3 * PERIOD))
    step(1.0, 2 * PERIOD)
    assert slave.get("M") == 21.0


@needs_compiler
def test_a_kept_state_has_its_time_and_a_constant_is_never_set(loop_fmu, tmp_path):
    slave = Slave(loop_fmu, tmp_path)
    slave.fmu.doStep(0.0, PERIOD)
    kept = slave.fmu.getFMUState()
    slave.fmu.doStep(PERIOD, PERIOD)
    slave.fmu.terminate()
    slave.fmu.setFMUState(kept)
    assert refusals(slave, lambda: slave.fmu.doStep(2 * PERIOD, PERIOD))
    slave.fmu.doStep(PERIOD, PERIOD)
    constants = [v.name for v in fmpy.read_model_description(loop_fmu).modelVariables if v.variability == "constant"]
    assert constants
    slave.fmu.reset()
    slave.fmu.enterInitializationMode()
    assert all(refusals(slave, lambda name=name: slave.set(**{name: 1.0})) for name in constants)


@needs_compiler
def test_model_exchange_keeps_to_its_modes(plant_fmu, tmp_path):
    from fmpy.fmi2 import FMU2Model

    slave = Slave(plant_fmu, tmp_path / "slave")
    description = fmpy.read_model_description(plant_fmu)
    model = object.__new__(Slave)
    model.places = slave.places
    model.fmu = FMU2Model(
        guid=description.guid, unzipDirectory=fmpy.extract(plant_fmu, tmp_path / "model"),
        modelIdentifier=description.modelExchange.modelIdentifier, instanceName="jack",
    )  # fmt: skip
    fmu = model.fmu
    fmu.instantiate()
    early = [fmu.newDiscreteStates, fmu.enterContinuousTimeMode, fmu.enterEventMode, fmu.completedIntegratorStep]
    assert refusals(model, *early, lambda: fmu.setTime(1.0))
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    model.set(command=0.1)
    fmu.newDiscreteStates()
    assert refusals(model, fmu.completedIntegratorStep, lambda: model.set(M=1.0))
    fmu.enterContinuousTimeMode()
    assert refusals(model, fmu.newDiscreteStates, lambda: model.set(M=1.0))
    fmu.setTime(PERIOD)
    fmu.completedIntegratorStep()
    fmu.enterEventMode()
    fmu.newDiscreteStates()
