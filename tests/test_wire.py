"""serve, drive and record at a rig behind a wire: what they leave, and what a rig with hidden effects does."""

import json
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from made_links import Stranger, at, jack_bench, served

from controllers.p import P
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.step_experiment import load_steps
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.link import datagrams
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.course import rest_record
from workbench.link.wire_loop import WireLoop, WireRun
from workbench.loop.guarded_controller import GuardedController
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.records.campaign import load_campaign
from workbench.rigs.rig_file import load_rig, read_effects

TUNED = load_steps("experiments/position_tuned.toml")
RIG = TUNED.rig
STEP = np.full(200, 1e-3)
HIDDEN = """
[[effects]]
name = "jack.friction"
Fc = {value = 0.4, unit = "kN"}
"""


@pytest.mark.parametrize("spec", TUNED.controllers, ids=lambda spec: spec.name)
def test_every_law_at_a_rig_in_lockstep_is_its_simulation(spec):
    with served(jack_bench(ideal=True)) as server, LinkClient(at(server)) as client:
        loop = WireLoop(client, RIG, spec.build(RIG.period.value), noisy=False)
        run = loop.run(STEP)
        loop.end()
    plant = build(RIG)
    wanted = SampledLoop(Engine(plant), RIG, spec.build(RIG.period.value), equilibrium(plant), compiled=False).run(STEP)
    for name in ("position", "pa", "command"):
        scale = np.abs(wanted.record.signals[name]).max()
        np.testing.assert_allclose(run.record.signals[name], wanted.record.signals[name], atol=1e-11 * scale, rtol=0)
    assert (run.ended, run.late) == (None, 0)


def test_a_compiled_law_and_guard_are_those_in_python():
    spec = next(spec for spec in TUNED.controllers if spec.name == "p-dp")
    random, signals = np.random.default_rng(1), ("pa", "pb", "position", "spool", "supply")
    from workbench.loop.compiled_controller import controller_on

    compiled = controller_on(RIG, spec.build(RIG.period.value), signals, noisy=True)
    plain = GuardedController(RIG, spec.build(RIG.period.value), noisy=True)
    still = {"pa": 1e7, "pb": 1e7, "position": 0.0, "spool": 0.0, "supply": 2.1e7}
    for each in (compiled, plain):
        each.reset(still, 0.0)
    for k in range(300):
        noisy = {
            name: value + random.normal() * (2e4 if name in ("pa", "pb", "supply") else 2e-5)
            for name, value in still.items()
        }
        added = np.nan if k == 200 else 0.0  # what is no number trips both
        a, b = (each.sample(noisy, 1e-3, added)[0] for each in (compiled, plain))
        assert a == pytest.approx(b, abs=1e-12)
    assert compiled.tripped == plain.tripped is not None


class Cut(P):
    """Raises after so many samples, as Ctrl-C would."""

    samples = 0

    def compute(self, reference, measurement):
        self.samples += 1
        if self.samples > 50:
            raise KeyboardInterrupt
        return super().compute(reference, measurement)


def test_an_interrupted_loop_goes_to_zero_by_the_guards_ramp_and_keeps_its_record():
    with served(jack_bench()) as server, LinkClient(at(server)) as client:
        loop = WireLoop(client, RIG, Cut(P.Design(gain=10.0), RIG.period.value))
        run = loop.run(np.full(400, 0.02))
        loop.end()
        assert server.rig.state == "off"
    assert run.ended == "interrupted"
    command = run.record.signals["command"]
    assert len(command) > 50
    assert np.abs(np.diff(command)).max() <= RIG.limit("command_rate") * RIG.period.value + 1e-12
    assert command[-1] == 0


def test_a_trip_of_the_rig_and_a_lost_link_end_a_loop_with_its_record():
    with served(jack_bench()) as server, LinkClient(at(server)) as client:
        loop = WireLoop(client, RIG, P(P.Design(gain=2.0), RIG.period.value))
        loop.run(np.zeros(20))
        server.rig.stop(1)
        run = loop.run(np.zeros(50))
        assert "nearest to its limit was position" in run.ended
        server.wish(datagrams.RESET)
        again = WireLoop(client, RIG, P(P.Design(gain=2.0), RIG.period.value))
        server.stop()
        time.sleep(0.3)
        lost = again.run(np.zeros(50))
    assert "no answer" in lost.ended
    assert len(lost.record.t) >= 1


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A rig that rubs behind the wire, driven by the experiment of the rig that does not."""
    folder = tmp_path_factory.mktemp("driven")
    (folder / "hidden.toml").write_text(HIDDEN)
    rubs = replace(RIG, effects=read_effects(folder / "hidden.toml"))
    with served(bench(rubs, True)) as server:
        words = ["drive", "experiments/position_tuned.toml", "--controller", "p-dp-shaped", "--at", at(server)]
        assert main([*words, "--out", str(folder / "drive")]) == 0
        assert server.rig.state == "off"
    (folder / "rubs.toml").write_text(_text(rubs))
    words = ["run", "experiments/position_tuned.toml", "--rig", str(folder / "rubs.toml")]
    return folder, json.loads((folder / "drive/metrics.json").read_text())


def _text(rig):
    from workbench.rigs.rig_file import rig_text

    return rig_text(replace(rig, name="rubs"))


def test_a_hidden_effect_settles_as_the_loop_in_simulation_on_that_rig(driven):
    folder, metrics = driven
    rubs = load_rig(folder / "rubs.toml")
    from workbench.loop.rig_variations import with_delay
    from workbench.loop.rows import judge, linear_loops, loop_setup

    spec = next(spec for spec in TUNED.controllers if spec.name == "p-dp-shaped")
    setup = loop_setup(with_delay(rubs, rubs.computing_delay.value))
    loops = linear_loops(spec, setup)
    rows = {row["scenario"]: row for row in metrics["rows"]}
    assert metrics["ended"] is None
    assert metrics["left_out"] == ["position-load-20kn"]
    for scenario in TUNED.scenarios:
        if scenario.name in ("position-10mm", "position-100mm"):
            _, want = judge(spec, scenario, setup, loops, 0)
            assert rows[scenario.name]["settling_s"] == pytest.approx(want["settling_s"], abs=0.01)
            assert rows[scenario.name]["overshoot_percent"] == pytest.approx(want["overshoot_percent"], abs=1.0)


def test_what_was_driven_is_a_campaign_that_shows_the_effect(driven, tmp_path):
    folder, _ = driven
    campaign = load_campaign(folder / "drive")
    assert {record.name for record in campaign.heldout}
    assert main(["residual", str(folder / "drive"), "--out", str(tmp_path / "residual")]) == 0
    assert json.loads((tmp_path / "residual/metrics.json").read_text())["chi2"] > 1.5


def test_a_recorded_live_rig_is_explained_by_its_own_file(tmp_path):
    (tmp_path / "play.csv").write_text(
        "t [s],command [1]\n" + "".join(f"{k / 1000:.3f},{0.05 * (k // 200 % 2)}\n" for k in range(1200)) + "1.2,0\n"
    )
    with served(jack_bench()) as server:
        words = ["record", "jack-10t", "--at", at(server), "--play", str(tmp_path / "play.csv")]
        assert main([*words, "--out", str(tmp_path / "records")]) == 0
    assert main(["residual", str(tmp_path / "records"), "--out", str(tmp_path / "residual")]) == 0
    assert json.loads((tmp_path / "residual/metrics.json").read_text())["chi2"] == pytest.approx(1.0, abs=0.1)


def test_serve_prints_where_it_is_first_and_leaves_its_figures(tmp_path):
    words = [sys.executable, "-m", "workbench.cli", "serve", "jack-10t", "--realtime", "--out", str(tmp_path / "out")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stderr
        first = process.stdout.readline().strip()
        assert first.startswith("udp://127.0.0.1:")
        with LinkClient(first) as client:
            client.on()
            for _ in range(100):
                client.exchange((0.0,))
            client.off()
        process.send_signal(signal.SIGTERM)
        process.wait(20)
        errors = process.stderr.read()
    assert process.returncode == 0, errors
    metrics = json.loads((tmp_path / "out/metrics.json").read_text())
    assert metrics["periods"] >= 100
    assert metrics["jitter_us"]["p50"] is not None
    assert metrics["age_us"]["worst"] >= 0
    assert 0 < metrics["core_load"] < 1
    assert (metrics["dropped"], metrics["trips"]) == (0, 0)
    assert (tmp_path / "out/report.html").is_file()
    assert "its page: http://127.0.0.1:" in errors


def test_services_in_one_folder_number_what_they_leave(tmp_path, monkeypatch):
    """One at work, one that is finished, and one that was killed; each has a folder of its own."""
    from workbench.commands.serve import study

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study, "_until_interrupted", lambda _: None)
    (tmp_path / "out/serve-jack-10t.partial/stages").mkdir(parents=True)
    for _ in range(2):
        assert main(["serve", "jack-10t", "--specimen", "1e7 N/m"]) == 0
    finished = ["serve-jack-10t-2", "serve-jack-10t-3"]
    assert sorted(path.name for path in (tmp_path / "out").glob("serve*[0-9t]")) == finished
    metrics = tmp_path / "out/serve-jack-10t/metrics.json"
    assert main(["serve", "jack-10t", "--force", "--out", "out/serve-jack-10t-2"]) == 0
    assert main(["serve", "jack-10t", "--out", "out/serve-jack-10t-2"]) == 2
    assert not metrics.exists()


def test_a_service_that_is_stopped_before_it_serves_leaves_no_folder(tmp_path, monkeypatch):
    from workbench.commands.serve import study

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study, "run_service", interrupted)
    assert main(["serve", "jack-10t"]) == 130
    assert not list(tmp_path.glob("out/serve*"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["serve", "jack-10t", "--rate", "9000"], "at most 5000 Hz in real time"),
        (["serve", "jack-10t", "--rate", "-1"], "must be above 0"),
        (["serve", "jack-10t", "--port", "99999"], "--port 99999"),
        (["serve", "jack-10t", "--bind", "0.0.0.0"], "give it a --token"),
        (["serve", "jack-10t", "--effects", "nowhere.toml"], "nowhere.toml"),
        (["serve", "hexapod", "--specimen", "1e7 N/m"], "serve a rig"),
        (["serve", "jack-10t", "--specimen", "7 apples"], '--specimen: unknown unit "apples"'),
        (["serve", "nothing"], "nothing"),
        (["drive", "first_loop", "--at", "tcp://x:1"], "write udp://HOST:PORT"),
        (["drive", "first_loop", "--at", "udp://127.0.0.1:9"], "no rig answers there"),
        (["drive", "first_loop", "--at", "udp://127.0.0.1:9", "--controller", "q"], "--controller q"),
        (["record", "jack-10t", "--at", "udp://127.0.0.1:9"], "no rig answers there"),
    ],
)
def test_bad_input_is_one_line(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("workbench.link.client._TRIES", 2)
    assert main([*words, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.splitlines()
    assert message in error[-1]
    assert not (tmp_path / "out").exists()


def test_a_rig_of_another_period_or_without_a_channel_is_refused():
    slow = replace(RIG, period=replace(RIG.period, value=2e-3))
    blind = replace(RIG, sensors={name: s for name, s in RIG.sensors.items() if name != "position"})
    for other, message in ((slow, "500 Hz"), (blind, "no channel position")):
        with served(bench(other, True)) as server, LinkClient(at(server)) as client:
            with pytest.raises(InputError, match=message):
                WireLoop(client, RIG, P(P.Design(gain=2.0), RIG.period.value))
            assert server.rig.state == "off"


def test_a_flood_makes_a_rig_in_real_time_drop_and_not_stand_still():
    """Fifty thousand datagrams a second for a second, from another client."""
    with served(jack_bench(computes=False), lockstep=False) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)
        stop = threading.Event()

        def flood():
            with Stranger(server) as other:
                while not stop.is_set():
                    for _ in range(50):
                        other.socket.send(b"JBRIG\x02flood")
                    time.sleep(0.001)

        thread = threading.Thread(target=flood)
        thread.start()
        begun, first = time.monotonic(), client.reading()[2]
        sequence = 0
        while time.monotonic() - begun < 1.0:
            sequence += 1
            client.command(sequence, 0.0)
            _status, applied, tick, _ = client.reading()
        stop.set()
        thread.join()
        lasted = time.monotonic() - begun
        assert tick - first > 0.9 * lasted / RIG.period.value - 50
        assert applied > 100
        assert server.dropped > 1000


def test_a_panel_looks_on_by_opc_ua_and_may_switch():
    asyncua = pytest.importorskip("asyncua")
    import asyncio
    import socket

    from workbench.link.opc_ua import NAMESPACE, opc_ua_server, supervised_loop, supervised_rig

    async def look(url, name, nodes, method):
        async with asyncua.Client(url) as panel:
            space = await panel.get_namespace_index(NAMESPACE)
            rig = await panel.nodes.objects.get_child([f"{space}:{name}"])
            await rig.call_method(f"{space}:{method}")
            await asyncio.sleep(0.5)
            found = [await rig.get_child([f"{space}:{node}"]) for node in nodes]
            unit = await (await found[0].get_child([f"{space}:EngineeringUnits"])).read_value()
            return unit, [await node.read_value() for node in found]

    def free():
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return probe.getsockname()[1]

    with served(jack_bench()) as server:
        with opc_ua_server(supervised_rig(server), free()) as url:
            unit, values = asyncio.run(look(url, "jack-10t", ["supply", "state", "mode"], "start"))
        assert (unit, values[1:]) == ("Pa", ["on", "lockstep"])
        assert values[0] == pytest.approx(2.1e7, rel=0.01)
        server.wish(datagrams.OFF)
        stops = []
        with LinkClient(at(server)) as client:
            client.on()
            client.asked = (0.25, 0.0)
            client.exchange((0.5,))
            with opc_ua_server(supervised_loop(client, lambda: stops.append(1)), free()) as url:
                _, values = asyncio.run(look(url, "jack-10t", ["position", "reference", "command", "on"], "stop"))
        assert values[1:] == [0.25, 0.5, True]
        assert stops == [1]


def test_a_rig_is_served_with_effects_at_another_rate_and_on_a_specimen(tmp_path):
    from workbench.commands.serve.config import Service, service

    (tmp_path / "hidden.toml").write_text(HIDDEN)
    wanted = Service(lockstep=True, seed=0, ideal=False, port=0, host="", token="", page_port=0)
    rig = service(wanted, "jack-10t", 2000.0, tmp_path / "hidden.toml", "10 kN/mm")
    assert [use.name for use in rig.effects] == ["jack.friction"]
    assert (rig.period.value, rig["ks"]) == (5e-4, 1e7)
    assert service(wanted, "jack-10t", None, None, "stiffness-1e6")["ks"] == 1e6
    six = service(wanted, "hexapod", 2000.0, tmp_path / "hidden.toml", None)
    assert six.period == 5e-4
    assert all(leg.rig.effects for leg in six.legs)


class Slow(LinkClient):
    """A client that takes one reading in ten, as one does whom other work keeps."""

    def exchange(self, values):
        for _ in range(9):
            super().exchange(values)
        return super().exchange(values)


def test_readings_that_are_lost_in_a_fast_motion_are_no_trip_and_the_controller_keeps_its_time():
    reference = 0.05 * np.minimum(1.0, np.arange(400) / 80)
    spec = next(spec for spec in TUNED.controllers if spec.name == "p-dp")
    with served(jack_bench()) as server, Slow(at(server)) as client:
        loop = WireLoop(client, RIG, spec.build(RIG.period.value))
        run = loop.run(reference)
        loop.end()
    speed = np.abs(np.diff(run.record.signals["position"])) / RIG.period.value
    assert speed.max() > RIG.limit("speed")  # were each step of the position that of one period
    assert run.ended is None
    assert run.late == 9 * len(run.rows)
    assert run.record.signals["position"][-1] == pytest.approx(0.05, abs=1e-3)


def test_readings_that_are_lost_between_two_runs_of_a_moving_jack_are_no_trip():
    reference = 0.05 * np.minimum(1.0, np.arange(400) / 80)
    spec = next(spec for spec in TUNED.controllers if spec.name == "p-dp")
    with served(jack_bench()) as server, Slow(at(server)) as client:
        loop = WireLoop(client, RIG, spec.build(RIG.period.value))
        for part in np.split(reference, 10):
            run = loop.run(part)
            assert run.ended is None
            assert run.rows[-1][0] < len(part)
        loop.end()


class Late(LinkClient):
    """A client in real time, as a rig in lockstep plays it: each answer comes so many periods after its own, and until
    then the rig goes on with the one before. `acted`: the command from each reading on."""

    def __init__(self, where: str, late: list[int]) -> None:
        super().__init__(where)
        self.hello = replace(self.hello, lockstep=False)
        self._late, self._acting, self._number, self.acted = iter(late), 0.0, 0, [0.0]

    @property
    def sequence(self):
        return self._number

    def exchange(self, values):
        self._number, before = self._number + 1, self._old
        readings = []
        for _ in range(next(self._late) + 1):
            self.hello = replace(self.hello, lockstep=True)
            readings.append(replace(super().exchange((self._acting,)), sequence=before))
            self.hello = replace(self.hello, lockstep=False)
            self.acted.append(self._acting)
        self._old, self._acting, self.acted[-1] = self._number, values[0], values[0]
        self.passed = readings[:-1]
        return replace(readings[-1], sequence=self._number)

    _old = 0


def test_a_record_at_rest_has_the_readings_that_came_while_the_machine_was_busy():
    late = np.random.default_rng(4).choice([0, 0, 0, 3], 2000).tolist()
    with served(jack_bench(computes=False)) as server, Late(at(server), late) as client:
        record = rest_record(client, RIG)
    assert np.diff(record.t) == pytest.approx(RIG.period.value)


def test_a_record_in_real_time_has_every_reading_and_the_command_that_acted_however_late_an_answer_was():
    late = np.random.default_rng(3).choice([0, 0, 0, 0, 1, 2], 400).tolist()
    reference = 0.005 * np.sin(2 * np.pi * 4 * np.arange(400) * RIG.period.value)
    spec = next(spec for spec in TUNED.controllers if spec.name == "p-dp")
    with served(jack_bench(computes=False)) as server, Late(at(server), late) as client:
        loop = WireLoop(client, RIG, spec.build(RIG.period.value))
        run = loop.run(reference)
        loop.end()
    assert run.ended is None
    assert run.late > 50
    ticks = [row[0] for row in run.rows]
    assert ticks == list(range(len(ticks)))
    assert run.record.signals["command"].tolist() == client.acted[: len(ticks)]


def test_a_reading_that_is_no_number_is_recorded_as_not_valid():
    run = WireRun(1e-3, ("position", "pa"))
    for tick, pa in enumerate((1e7, np.nan, 1.1e7)):
        run.keep(datagrams.Reading(0, tick, tick, (0.0, pa)), 0, 0.0, 0.0, 0.0)
    assert run.record.valid["pa"].tolist() == [True, False, True]
