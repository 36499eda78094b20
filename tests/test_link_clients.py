"""The clients of examples/link/, written after the page on the link, close a P loop on a served rig."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from made_links import at, jack_bench, served
from made_loops import run_loop

from controllers.p import P
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.plant import build

FOLDER = Path(__file__).parents[1] / "examples" / "link"
GCC = shutil.which("gcc")
GAIN, STEP, SECONDS = 0.3, 0.01, 1.0  # as both clients have them


def python(_):
    return [sys.executable, "-I", str(FOLDER / "p_loop.py")], lambda server: [at(server)]


def c(folder):
    if GCC is None:
        pytest.skip("no C compiler here")
    program = folder / "p_loop"
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]
    subprocess.run([GCC, *strict, str(FOLDER / "p_loop.c"), "-o", str(program)], check=True)
    return [str(program)], lambda server: map(str, server.address)


def moved(rig):
    """How far [mm] the workbench's own loop has moved the jack at the last sample."""
    plant = build(rig)
    law = P(P.Design(gain=GAIN), rig.period.value)
    samples = round(SECONDS / rig.period.value) + 1
    run = run_loop(Engine(plant), rig, law, equilibrium(plant), np.full(samples, STEP))
    return 1e3 * run.record.signals["position"][-1]


@pytest.mark.parametrize("client", [python, c])
def test_a_client_moves_the_jack_as_the_workbench_s_loop_does(tmp_path, rig, client):
    command, place = client(tmp_path)
    with served(jack_bench(ideal=True)) as server:
        done = subprocess.run([*command, *place(server)], check=True, capture_output=True, text=True, timeout=60)
        assert server.rig.state == "off"
    assert f"moved {moved(rig):.3f} of 10 mm in 1 s" in done.stdout
    assert "on its way" in done.stdout


@pytest.mark.parametrize("client", [python, c])
def test_a_client_plays_in_real_time(tmp_path, rig, client):
    command, place = client(tmp_path)
    with served(jack_bench(computes=False), lockstep=False) as server:
        done = subprocess.run([*command, *place(server)], check=True, capture_output=True, text=True, timeout=60)
    assert float(done.stdout.partition("moved ")[2].split()[0]) == pytest.approx(moved(rig), abs=0.5)


@pytest.mark.skipif(sys.platform == "win32", reason="its processes know no SIGHUP")
@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("client", [python, c])
def test_a_client_that_is_ended_switches_the_rig_off(tmp_path, client, how):
    command, place = client(tmp_path)
    with served(jack_bench(computes=False), lockstep=False) as server:
        with subprocess.Popen([*command, *place(server)], stderr=subprocess.PIPE, text=True) as process:
            while server.rig.state != "on":
                assert process.poll() is None
                time.sleep(0.005)
            for _ in range(2):  # as a closed terminal sends several
                process.send_signal(getattr(signal, how))
            assert process.communicate(timeout=30)[1] == "interrupted\n"
        assert process.returncode == 1
        assert server.rig.state == "off"


def test_the_python_client_is_short():
    assert len((FOLDER / "p_loop.py").read_text().splitlines()) <= 72
