"""Commands that SIGTERM or a closed terminal ends: the rig is off, what was recorded is there, no process is left."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from made_links import at, jack_bench, served

from workbench.cli import main
from workbench.records.campaign import load_campaign
from workbench.rigs.rig_file import load_rig

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="its processes know no SIGHUP")
END = {"term": signal.SIGTERM, "hup": signal.SIGHUP}
RIG = load_rig("jack-10t")
DRIVE = ["drive", "experiments/position_tuned.toml", "--controller", "p-dp"]

SHARED = """
import os, sys, time
from pathlib import Path
from workbench.base.checkpoint import no_checkpoint
from workbench.base.process_pool import process_pool
from workbench.cli import main
from workbench.commands.list import options

def work(folder):
    Path(folder, f"{os.getpid()}.pid").touch()
    time.sleep(60)

def make():
    return work

def shared(rows):
    with process_pool(2, make) as pool:
        pool(dict.fromkeys("abcd", sys.argv[1]), no_checkpoint, print)

if __name__ == "__main__":
    options.listing_text = shared
    sys.exit(main(["list", "rigs"]))
"""

LIMIT = """
import sys, time
from pathlib import Path
from workbench.cli import main
from workbench.commands.live import limit

def work(step):
    Path(sys.argv[1], "busy").touch()
    time.sleep(60)

def make():
    return work

if __name__ == "__main__":
    limit.limit_finder = make
    sys.exit(main(["live", "position_step"]))
"""


def started(*words, **more):
    """The command in a session of its own, as another process."""
    command = [sys.executable, "-m", "workbench.cli", *map(str, words)]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True, **more)


def until(true, process):
    limit = time.monotonic() + 60
    while not true():
        assert process.poll() is None
        assert time.monotonic() < limit
        time.sleep(0.005)


def away(server, far):
    """Whether its rig is on, so far [m] from the middle."""
    rig = server.rig
    place = rig.bench.plant.output("position")
    return lambda: rig.state == "on" and abs(rig.outputs[place]) > far


def check_left(out):
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["ended"] == "interrupted"
    records = {each.name: each for each in (*load_campaign(out).train, *load_campaign(out).heldout)}
    (last,) = (each for name, each in records.items() if f"{name}-back" not in records and not name.endswith("-back"))
    assert np.abs(last.signals["position"]).max() > 1e-3  # it was under way
    assert abs(last.signals["command"][-1]) <= RIG.limit("command_rate") * RIG.period.value  # down by the guard's ramp
    return metrics


def test_a_drive_that_is_ended_switches_the_rig_off_and_leaves_its_records(tmp_path):
    with served(jack_bench()) as server, started(*DRIVE, "--at", at(server), "--out", tmp_path / "out") as process:
        until(away(server, 0.03), process)
        process.send_signal(signal.SIGTERM)
        said = process.stderr.read()
        assert process.wait(60) == 0, said
        assert server.rig.state == "off"
    metrics = check_left(tmp_path / "out")
    assert [row["scenario"] for row in metrics["rows"]][-1] == "position-100mm"
    assert len(metrics["rows"]) > 1


def test_a_closed_terminal_ends_a_drive_with_its_records(tmp_path):
    """It takes no line of the command any more, and hangs up on it more than once."""
    import fcntl
    import pty
    import termios

    screen, terminal = pty.openpty()
    words = [sys.executable, "-m", "workbench.cli", *DRIVE, "--out", str(tmp_path / "out"), "--at"]
    with served(jack_bench()) as server:
        process = subprocess.Popen(
            [*words, at(server)], cwd=ROOT, stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )  # fmt: skip
        os.close(terminal)
        until(away(server, 0.03), process)
        os.close(screen)
        process.send_signal(signal.SIGHUP)
        process.wait(60)
        assert server.rig.state == "off"
    check_left(tmp_path / "out")


def test_a_recording_that_is_ended_switches_the_rig_off_and_leaves_what_it_has(tmp_path):
    rows = "".join(f"{k / 1000:.3f},{0.05 * (k // 200 % 2)}\n" for k in range(20_001))
    (tmp_path / "play.csv").write_text(f"t [s],command [1]\n{rows}")
    words = ["record", "jack-10t", "--play", tmp_path / "play.csv", "--out", tmp_path / "out"]
    with served(jack_bench()) as server, started(*words, "--at", at(server)) as process:
        until(away(server, 2e-3), process)
        process.send_signal(signal.SIGHUP)
        said = process.stderr.read()
        assert process.wait(60) == 0, said
        assert server.rig.state == "off"
    check_left(tmp_path / "out")


def test_a_commission_that_is_ended_switches_off_a_rig_that_stays_on_between_courses(tmp_path):
    with (
        served(jack_bench()) as server,
        started("commission", "jack-10t", "--at", at(server), "--out", tmp_path / "out") as process,
    ):
        until(away(server, 1e-3), process)
        process.send_signal(signal.SIGTERM)
        said = process.stderr.read()
        assert process.wait(60) == 128 + signal.SIGTERM, said
        assert server.rig.state == "off"
    assert said.endswith("jackbench: interrupted; the same command resumes\n")
    assert (tmp_path / "out.partial/stages/played-static.json").exists()


def test_a_watch_that_is_ended_says_so_at_once_and_leaves_no_report(tmp_path):
    for day in ("2026-01-01", "2026-01-08"):
        (tmp_path / "rig" / day).mkdir(parents=True)
        for file in (ROOT / "experiments/sample").iterdir():
            (tmp_path / "rig" / day / file.name).symlink_to(file)
    own = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    with started("watch", tmp_path / "rig", "--out", tmp_path / "out", env=own) as process:
        assert "session 1 of 2" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        said = process.stderr.read()
        assert process.wait(60) == 128 + signal.SIGTERM, said
    assert said.endswith("jackbench: interrupted; the same command resumes\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("how", END)
def test_a_command_that_is_ended_takes_its_workers_with_it_at_once(how, tmp_path):
    """Whatever they are at, and though the signal is not for them."""
    (tmp_path / "script.py").write_text(SHARED)
    words = [sys.executable, tmp_path / "script.py", tmp_path]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=ROOT) as process:
        until(lambda: len([*tmp_path.glob("*.pid")]) == 2, process)
        process.send_signal(END[how])
        began = time.monotonic()
        said = process.stderr.read()  # that of its workers too, so that it ends with the last of them
        assert process.wait(20) == 128 + END[how], said
    assert time.monotonic() - began < 20
    assert said == "jackbench: interrupted; the same command resumes\n"


def test_the_status_is_the_same_where_the_signal_meets_what_python_builds_from_text(tmp_path):
    """As every dataclass is, while modules are imported; python -m would end by SIGINT then."""
    script = "import os, sys; from workbench.cli import main; from workbench.commands.list import options\n"
    script += "options.listing_text = lambda _: exec('os.kill(os.getpid(), 15); os.getpid()')\n"
    (tmp_path / "script.py").write_text(f"{script}sys.exit(main(['list', 'rigs']))")
    paths = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    done = subprocess.run([sys.executable, "-m", "script"], cwd=ROOT, env=paths, check=False)
    assert done.returncode == 128 + signal.SIGTERM


def test_an_interrupted_command_that_replaces_says_that_it_begins_anew(tmp_path, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("workbench.commands.common.run_folder.open_run", interrupted)
    out = ["residual", "sample", "--out", str(tmp_path / "out")]
    for words, said in ([], "the same command resumes"), (["--force"], "with --force the same command begins anew"):
        main([*out, *words])
        assert capsys.readouterr().err == f"jackbench: interrupted; {said}\n"


def test_who_ignores_hang_ups_goes_on(tmp_path, monkeypatch):
    """As under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        hung_up = "workbench.commands.list.options.listing_text"
        monkeypatch.setattr(hung_up, lambda _: os.kill(os.getpid(), signal.SIGHUP))
        assert main(["list", "rigs"]) == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_live_page_ends_at_once_though_a_limit_is_being_solved(tmp_path):
    (tmp_path / "script.py").write_text(LIMIT)
    words = [sys.executable, str(tmp_path / "script.py"), str(tmp_path)]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        address = urlsplit(process.stdout.readline().split()[0])
        asked = {"controller": "p-dp", "scenario": "position-10mm"}
        with closing(HTTPConnection(address.netloc)) as page:
            page.request("POST", f"{address.path}limit", json.dumps(asked), {"Origin": f"http://{address.netloc}"})
            until((tmp_path / "busy").exists, process)
            process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=20) == ("", "")
        assert process.returncode == 0
