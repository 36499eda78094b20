"""link_main.c: exported laws at a served rig do, to 1e-9 of the step, what the workbench's loop does in simulation."""

import csv
import shutil
import signal
import socket
import subprocess
import threading
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from made_links import at, jack_bench, served
from test_controllers import EXPERIMENTS

from workbench.cli import main
from workbench.commands.common.step_experiment import load_steps
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.link.bench import bench
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build

GCC = shutil.which("gcc")
pytestmark = pytest.mark.skipif(GCC is None, reason="no C compiler here")
STRICT = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
CONFIGS = {name: load_steps(EXPERIMENTS / f"{name}.toml") for name in ("position_tuned", "force_tuned")}
LAWS = {spec.name: (spec, config.rig, name) for name, config in CONFIGS.items() for spec in config.controllers}
SIZE = {"position": 1e-3, "force": 2e3}
JACK = jack_bench(ideal=True)
SECONDS, SEED = 0.3, 3


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """The program of each experiment's exported laws, by the experiment's name."""
    made = {}
    for name in CONFIGS:
        folder = tmp_path_factory.mktemp(name) / "laws"
        assert main(["coefficients", name, "--out", str(folder)]) == 0
        made[name] = folder / "link_main"
        sources = [str(path) for path in sorted(folder.glob("*.c"))]
        subprocess.run([GCC, *STRICT, *sources, "-lm", "-o", str(made[name])], check=True)
    return made


def bench_at(rig, position=None, ideal=True):
    """A rig in lockstep that rests at a position [m]."""
    made = bench(rig, True, ideal)
    return made if position is None else replace(made, start=equilibrium(made.plant, position=position))


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
    """The loop's run over a reference, and the law's readings in it."""
    delay = 0.0 if ideal else rig.computing_delay.value
    engine = Engine(build(with_delay(rig, delay)))
    start = equilibrium(engine.plant) if position is None else equilibrium(engine.plant, position=position)
    return SampledLoop(engine, rig, law, start, None if ideal else SEED).run(reference)


def law_of(spec, rig):
    """As it is exported."""
    return spec.build(rig.period.value)


def test_no_exported_law_is_left_out_here(programs):
    for experiment, program in programs.items():
        usage = subprocess.run([program], check=False, capture_output=True, text=True).stderr
        exported = usage.partition("NAME:")[2].split()
        assert exported == [name.replace("-", "_") for name, (_, _, source) in LAWS.items() if source == experiment]


@pytest.mark.parametrize(
    ("name", "position"), [*((name, None) for name in LAWS), ("p-dp", 0.1), ("lqg", -0.1)], ids=str
)
def test_the_program_s_run_is_the_simulation(programs, name, position):
    """Every law that the tuned experiments export, without noise; from elsewhere its schedule differs."""
    spec, rig, experiment = LAWS[name]
    law = law_of(spec, rig)
    signal, plain = law.measures[0], name.replace("-", "_")
    with served(bench_at(rig, position)) as server:
        columns = played(programs[experiment], plain, at(server), SIZE[signal], SECONDS)
    reference, samples = columns["reference"], round(SECONDS / rig.period.value)
    assert columns["tick"] == pytest.approx(np.arange(samples))
    assert np.ptp(reference) == pytest.approx(SIZE[signal])
    assert columns["command"][0] == pytest.approx(0.0, abs=1e-15)  # no bump
    run = simulated(rig, law, reference, position)
    assert run.tripped is None
    assert columns[signal] == pytest.approx(run.record.signals[signal], abs=1e-9 * SIZE[signal])
    assert columns["command"] == pytest.approx(run.demanded, abs=1e-9 * np.abs(run.demanded).max())
    assert np.ptp(columns[signal]) > 0.1 * SIZE[signal]  # it moved


@pytest.mark.parametrize("name", ["p-dp", "lqg"])
def test_with_noise_and_computing_delay_too(programs, name):
    """The loop's law begins at a reading before the first sample, the program's at the first: so does this one's."""
    spec, rig, experiment = LAWS[name]
    with served(bench_at(rig, ideal=False), seed=SEED) as server:
        columns = played(programs[experiment], name.replace("-", "_"), at(server), SIZE["position"], SECONDS)
    run = simulated(rig, StartsAtFirstSample(law_of(spec, rig)), columns["reference"], ideal=False)
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


def test_lost_and_doubled_datagrams_change_nothing(programs):
    with served(JACK) as server:
        whole = played(programs["position_tuned"], "p", at(server), 1e-3, 0.02)
    with served(JACK) as server, lossy(server.address) as way:
        again = played(programs["position_tuned"], "p", way, 1e-3, 0.02)
    assert all(np.array_equal(whole[name], again[name]) for name in whole)


def test_in_real_time_the_jack_moves_and_the_rig_is_off_at_the_end(programs):
    """A busy machine makes samples late; that it follows is what can be said."""
    with served(bench(LAWS["p-dp"][1], False), lockstep=False) as server:
        columns = played(programs["position_tuned"], "p_dp", at(server), 1e-2, 0.5)
        assert server.rig.state == "off"
    assert np.all(np.diff(columns["tick"]) > 0)
    assert 5e-3 < columns["position"][-1] < 1.5e-2


def test_ctrl_c_switches_the_rig_off(programs):
    with served(JACK) as server:
        words = [programs["position_tuned"], "p", at(server), "1e-3", "1e6"]
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
def test_what_does_not_work_is_said(programs, words, token, status, said):
    with served(JACK, token=token) as server:
        words = [at(server) if word == "AT" else word for word in words]
        done = subprocess.run([programs["position_tuned"], *words], capture_output=True, text=True, timeout=60)
    assert done.returncode == status
    assert said in done.stderr


def test_a_rig_at_another_rate_or_without_a_channel_is_refused(programs):
    rig = LAWS["p-dp"][1]
    faster = replace(rig, period=replace(rig.period, value=5e-4))
    blind = replace(rig, sensors={name: sensor for name, sensor in rig.sensors.items() if name != "pb"})
    for other, said in ((faster, "the rig's period is 0.0005 s"), (blind, "the rig has no channel pb")):
        with served(bench_at(other)) as server:
            words = [programs["position_tuned"], "p_dp", at(server), "1e-3", "0.1"]
            done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        assert done.returncode == 1
        assert said in done.stderr
