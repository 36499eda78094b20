"""link_main.c: exported laws at a served rig do, to 1e-9 of the step, what the workbench's loop does in simulation."""

import csv
import shutil
import signal
import socket
import subprocess
import threading
import tomllib
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from itertools import count, starmap

import numpy as np
import pytest
from made_links import at, jack_bench, served
from test_controllers import EXPERIMENTS

import controllers
from controllers import AmplitudePhase, Dither, P, Policy, Through
from workbench.base.table import ConfigTable
from workbench.commands.coefficients.folder import leave_laws
from workbench.commands.coefficients.laws import exported
from workbench.commands.common.step_experiment import load_steps
from workbench.control.controller_spec import controller_spec
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.link.bench import bench
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

GCC = shutil.which("gcc")
pytestmark = pytest.mark.skipif(GCC is None, reason="no C compiler here")
STRICT = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]


def text_of(source):
    return (EXPERIMENTS / f"{source}.toml").read_text("utf-8")


SHIPPED = (
    "position_tuned", "position_known", "position_mode", "position_policy", "position_mpc", "force_tuned", "force_step",
    "linear_plant", "pump_step",
)  # fmt: skip
ALSO = ("automatic", "policy", "dithered", "sines", "through")  # laws that no step experiment has
LAWS = [
    *((source, name) for source in SHIPPED for name in tomllib.loads(text_of(source))["controllers"]),
    *(("also", name) for name in ALSO),
]
JACK, JACK_10T = jack_bench(ideal=True), load_rig("jack-10t")
SECONDS, SEED = 0.15, 3


@cache
def config_of(source):
    """A step experiment by its name, or that of the laws that none has."""
    if source != "also":
        return load_steps(EXPERIMENTS / f"{source}.toml")
    config = load_steps(EXPERIMENTS / "position_policy.toml")
    network = config.controllers[0].compensators[-1].design.network
    specs = (
        controller_spec("automatic", ConfigTable(tomllib.loads(text_of("benchmark"))["controllers"]["automatic"], "")),
        Policy(network=replace(network, limit=1.0)),
        P(gain=3.0) + Dither(amplitude=0.03, frequency=170.0),
        P(gain=3.0) + AmplitudePhase(frequency=20.0, gain=0.5, phase=-80.0, gain3=0.1, phase3=-170.0),
        Through(gain=3.0),
    )
    return replace(config, controllers=tuple(spec.named(name) for spec, name in zip(specs, ALSO, strict=True)))


def spec_of(source, name):
    return next(spec for spec in config_of(source).controllers if spec.name == name)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Which gives the program of an experiment's exported laws."""

    @cache
    def made(source):
        folder, config = tmp_path_factory.mktemp(source) / "laws", config_of(source)
        laws, left_out = exported(config.rig, config.controllers, False)
        assert not left_out
        leave_laws(folder, config.rig, laws)
        sources = [str(path) for path in sorted(folder.glob("*.c"))]
        subprocess.run([GCC, *STRICT, *sources, "-lm", "-o", str(folder / "link_main")], check=True)
        return folder / "link_main"

    return made


def bench_at(rig, position=None, ideal=True):
    """A rig in lockstep that rests at a position [m]."""
    made = bench(rig, True, ideal)
    return made if position is None else replace(made, start=equilibrium(made.plant, position=position))


def plain(name):
    """A law's name as a program has it."""
    return name.replace("-", "_")


def played(program, *words):
    """The columns of a program's CSV by name."""
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    head, *rows = csv.reader(done.stdout.splitlines())
    return dict(zip(head, np.array(rows, float).T, strict=True))


class StartsAtFirstSample:
    """A law that begins when a client sees its first reading; a SampledLoop's begins a reading earlier."""

    def __init__(self, law):
        self._law, self._begun = law, False
        self.measures, self.update = law.measures, law.update

    def reset(self, reference, measurement, command):
        self._command = command

    def compute(self, reference, measurement):
        if not self._begun:
            self._begun = True
            self._law.reset(measurement[self.measures[0]], measurement, self._command)
        return self._law.compute(reference, measurement)


def simulated(rig, law, reference, position=None, ideal=True):
    """The loop's run over a reference, from rest with a drive that was off."""
    engine = Engine(build(with_delay(rig, 0.0 if ideal else rig.computing_delay.value)))
    rest = equilibrium(engine.plant) if position is None else equilibrium(engine.plant, position=position)
    start = replace(rest, u=np.append(0.0, rest.u[1:]))
    return SampledLoop(engine, rig, law, start, None if ideal else SEED).run(reference)


def motion(rig, signal):
    """A step that a rig can take within its limits: where a jack starts, its size, and the reference of it."""
    reach, samples = 0.2 * rig.limit("stroke"), round(SECONDS / rig.period.value)
    start = -reach if signal == "position" and rig.name == "jack-10t" else None
    made, size = bench_at(rig, start), 2 * reach if signal == "position" else 2e4
    outputs = made.engine.observe(made.start.x, made.start.u)
    reference = np.full(samples, outputs[made.plant.output(signal)])
    reference[samples // 10 :] += size
    return start, size, reference


def narrow(rig, demanded):
    """The rig with a drive that gives 0.6 of what a law demands at most, so that it saturates."""
    most = min(0.6 * np.abs(demanded).max(), 1.0)
    largest = replace(rig.limits["command_rate"], name="command", value=most, unit="1", si="1")
    return replace(rig, limits=rig.limits | {"command": largest})


def test_every_shipped_law_that_has_a_graph_is_here():
    """Automatic tunes itself to the law "automatic", and Switched has others in it: both compute in Python."""
    used = {part.use.rpartition(":")[2] for spec in starmap(spec_of, LAWS) for part in (spec, *spec.compensators)}
    assert set(controllers.__all__) - used == {"Automatic", "Switched"}


def of_other_parts():
    """Of every experiment the laws that have a part which no law before has, or the first one."""
    seen = set()
    for source in dict.fromkeys(source for source, _ in LAWS):
        names = [name for other, name in LAWS if other == source]
        for name in names:
            spec = spec_of(source, name)
            parts = {each.use for each in (spec, *spec.compensators)}
            if name == names[0] or not parts <= seen:
                yield source, name
            seen |= parts


@pytest.mark.parametrize(("source", "name"), [*of_other_parts()], ids=str)
def test_the_program_s_run_is_the_simulation(program, source, name):
    """Without noise, with a drive that the law saturates; a jack off mid stroke, where schedules count."""
    rig, law = config_of(source).rig, spec_of(source, name).build(config_of(source).rig.period.value)
    signal = law.measures[0]
    start, size, reference = motion(rig, signal)
    rig = narrow(rig, simulated(rig, law, reference, start).demanded)
    with served(bench_at(rig, start)) as server:
        columns = played(program(source), plain(name), at(server), size, SECONDS)
    assert columns["tick"] == pytest.approx(np.arange(len(reference)))
    assert columns["reference"] == pytest.approx(reference, abs=1e-9 * size)
    run = simulated(rig, law, columns["reference"], start)
    assert run.tripped is None
    assert np.abs(columns["command"]).max() > 1.01 * rig.limit("command")
    assert columns[signal] == pytest.approx(run.record.signals[signal], abs=1e-9 * size)
    assert columns["command"] == pytest.approx(run.demanded, abs=1e-9 * np.abs(run.demanded).max())


@pytest.mark.parametrize("name", ["p-dp", "lqg"])
def test_with_noise_and_computing_delay_too(program, name):
    """The loop's law begins at a reading before the first sample, the program's at the first: so does this one's."""
    law = StartsAtFirstSample(spec_of("position_tuned", name).build(JACK_10T.period.value))
    with served(bench_at(JACK_10T, ideal=False), seed=SEED) as server:
        columns = played(program("position_tuned"), plain(name), at(server), 1e-3, SECONDS)
    run = simulated(JACK_10T, law, columns["reference"], ideal=False)
    assert columns["command"] == pytest.approx(run.demanded, abs=1e-9 * np.abs(run.demanded).max())
    assert np.abs(columns["position"] - run.record.signals["position"]).max() > 1e-7  # what is measured has noise


@contextmanager
def lossy(address):
    """A way to a rig on which every third datagram is lost and every fifth comes twice."""
    near, far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    near.bind((address[0], 0))
    far.connect(address)
    near.settimeout(0.05)
    far.settimeout(0.05)
    client, over, seen = [], threading.Event(), count(1)

    def carry(source, send):
        while not over.is_set():
            with suppress(TimeoutError):
                data, client[:] = receive(source)
                for _ in range((next(seen) % 3 > 0) * (1 + (next(seen) % 5 == 0))):
                    send(data)

    def receive(source):
        if source is near:
            data, sender = near.recvfrom(4096)
            return data, [sender]
        return far.recv(4096), client

    ways = [
        threading.Thread(target=carry, args=(near, far.send)),
        threading.Thread(target=carry, args=(far, lambda data: near.sendto(data, client[0]))),
    ]
    for way in ways:
        way.start()
    try:
        yield "udp://{}:{}".format(*near.getsockname())
    finally:
        over.set()
        for way in ways:
            way.join()
        near.close()
        far.close()


def test_lost_and_doubled_datagrams_change_nothing(program):
    with served(JACK) as server:
        whole = played(program("position_tuned"), "p", at(server), 1e-3, 0.02)
    with served(JACK) as server, lossy(server.address) as way:
        again = played(program("position_tuned"), "p", way, 1e-3, 0.02)
    assert all(np.array_equal(whole[name], again[name]) for name in whole)


def test_in_real_time_the_jack_moves_and_the_rig_is_off_at_the_end(program):
    """A busy machine makes samples late; that it follows is what can be said."""
    with served(bench(JACK_10T, False), lockstep=False) as server:
        columns = played(program("position_tuned"), "p_dp", at(server), 1e-2, 0.5)
        assert server.rig.state == "off"
    assert np.all(np.diff(columns["tick"]) > 0)
    assert 5e-3 < columns["position"][-1] < 1.5e-2


def test_ctrl_c_switches_the_rig_off(program):
    with served(JACK) as server:
        words = [program("position_tuned"), "p", at(server), "1e-3", "1e6"]
        with subprocess.Popen(words, stdout=subprocess.PIPE) as running:
            assert running.stdout.readline().startswith(b"tick,")
            assert server.rig.state == "on"
            running.send_signal(signal.SIGINT)
            running.communicate(timeout=60)
        assert (running.returncode, server.rig.state) == (0, "off")


@pytest.mark.parametrize(
    ("words", "token", "status", "said"),
    [
        (["p"], "", 2, "usage"),
        (["q", "AT", "1e-3", "0.1"], "", 2, "NAME: p p_dp"),
        (["p", "udp:/127.0.0.1", "1e-3", "0.1"], "", 2, "write udp://HOST:PORT"),
        (["p", "AT", "1e-3", "0.1", "wrong"], "right", 1, "the rig refuses: wrong token"),
        (["p", "AT", "10", "1"], "", 1, "the rig tripped at tick"),
    ],
)
def test_what_does_not_work_is_said(program, words, token, status, said):
    with served(JACK, token=token) as server:
        words = [at(server) if word == "AT" else word for word in words]
        done = subprocess.run([program("position_tuned"), *words], capture_output=True, text=True, timeout=60)
    assert done.returncode == status
    assert said in done.stderr


def test_a_rig_at_another_rate_or_without_a_channel_is_refused(program):
    rig = JACK_10T
    faster = replace(rig, period=replace(rig.period, value=5e-4))
    blind = replace(rig, sensors={name: sensor for name, sensor in rig.sensors.items() if name != "pb"})
    for other, said in ((faster, "the rig's period is 0.0005 s"), (blind, "the rig has no channel pb")):
        with served(bench_at(other)) as server:
            words = [program("position_tuned"), "p_dp", at(server), "1e-3", "0.1"]
            done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        assert done.returncode == 1
        assert said in done.stderr
