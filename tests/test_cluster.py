"""The workers of a Dask cluster give to the byte what this machine gives; a worker that dies costs its task only."""

import json
import os
import signal
import socket
from pathlib import Path

import pytest
from made_experiments import P_DP

from experiments.studies.trace.given import Given
from experiments.studies.trace.study import run_trace_study
from workbench.base import cluster as cluster_module, trust
from workbench.base.cluster import cluster_at
from workbench.base.errors import ClusterError, InputError
from workbench.base.process_pool import process_pool
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint

distributed = pytest.importorskip("distributed", reason="distributed is not installed: the group cluster")
dask = pytest.importorskip("dask")
pytestmark = pytest.mark.filterwarnings("default")  # those of Dask are its own


@pytest.fixture(scope="module")
def two_workers():
    """They trust nothing by themselves, and a task may end one of them, not two."""
    failures = dask.config.set({"distributed.scheduler.allowed-failures": 1})
    with pytest.MonkeyPatch.context() as patch, failures:
        patch.setenv("JACKBENCH_TRUSTED", "")
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:
            yield cluster_at(local.scheduler_address)


def squares():
    made = os.getpid()
    return lambda number: {"square": number**2, "made": made, "pid": os.getpid()}


def refuses():
    raise InputError("rig: no equilibrium; ask for less")


def dies():
    return lambda _: os.kill(os.getpid(), signal.SIGKILL)


def dies_once():
    def work(mark):
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return mark.name

    return work


INSTALLATION = cluster_module.installation
ITEMS = {f"item-{i}": i for i in range(40)}


def test_results_come_in_order_from_the_workers_and_all_are_told(two_workers):
    told = []
    with process_pool(two_workers, squares) as work:
        results = work(ITEMS, no_checkpoint, told.append)
    assert [result["square"] for result in results] == [number**2 for number in range(40)]
    assert sorted(result["square"] for result in told) == [number**2 for number in range(40)]
    assert all(result["made"] == result["pid"] != os.getpid() for result in results)
    assert len({result["pid"] for result in results}) == 2


def test_bad_input_comes_through(two_workers):
    with pytest.raises(InputError, match="no equilibrium; ask for less"), process_pool(two_workers, refuses) as work:
        work(ITEMS, no_checkpoint, lambda _: None)


def test_workers_with_another_installation_are_refused_by_name(two_workers):
    message = r"worker tcp://\S+ has jackbench 0.0.1, not .*; install .*; 2 of 2 workers"
    with distributed.Client(two_workers.address, set_as_default=False) as client:
        client.run(installs, old)
        try:
            with pytest.raises(ClusterError, match=message), process_pool(two_workers, squares):
                pass
        finally:
            client.run(installs)


def installs(other=None):
    """On a worker."""
    cluster_module.installation = other or INSTALLATION


def old():
    return ("jackbench", "0.0.1"), *INSTALLATION()[1:]


BODE = """
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_percent = [50]
"""
EXPERIMENTS = {
    "bench": """
experiment = "bench"
rig = "jack-10t"
rigs = ["nominal", "mass+50"]
scenarios = ["position-10mm"]
[from]
"p_dp.toml" = ["p-dp"]
"""
    + BODE,
    "tune": """
experiment = "tune"
rig = "jack-10t"
rigs = ["nominal"]
scenarios = ["position-1mm"]
designs = 3
seed = 3
[weights]
settling_s = 10
"""
    + P_DP.replace('gain = "3 1/m"', 'gain = {value = 2, low = 0.5, high = 20, unit = "1/m", log = true}')
    + BODE.replace("percent = [50]", "mm = [1]"),
    "train": """
experiment = "train"
rig = "jack-10t"
rigs = ["nominal"]
scenarios = ["position-1mm"]
designs = 3
seed = 3
seeds = [1, 2]
[weights]
settling_s = 10
"""
    + P_DP
    + """
[network]
hidden = [2]
limit = {value = 0.1, unit = "1"}
error = {value = 10, unit = "mm"}
pressure = {value = 50, unit = "bar"}
slow = {value = 3, unit = "Hz"}
fast = {value = 30, unit = "Hz"}
"""
    + BODE.replace("percent = [50]", "mm = [1]"),
    "robustness": """
experiment = "robustness"
rig = "jack-10t"
plants = 20
seed = 1
step = {value = 10, unit = "mm"}
seconds = {value = 1, unit = "s"}
stroke = 0.9
positions = [0]
[within]
M = [0.5, 1.5]
[from]
"p_dp.toml" = ["p-dp"]
""",
}
STEPS = f"""
experiment = "steps"
rig = "jack-10t"
scenarios = ["position-10mm"]
{P_DP}{BODE.replace("percent = [50]", "mm = [1]")}"""


@pytest.mark.parametrize("command", EXPERIMENTS)
def test_a_command_leaves_to_the_byte_what_one_process_leaves(command, two_workers, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("p_dp.toml").write_text(STEPS)
    Path("tiny.toml").write_text(EXPERIMENTS[command])
    assert main([command, "tiny.toml", "--out", "here", "--jobs", "1"]) == 0
    assert main([command, "tiny.toml", "--out", "there", "--cluster", two_workers.address]) == 0
    here, there = (json.loads(Path(out, "metrics.json").read_text()) for out in ("here", "there"))
    for metrics in here, there:
        metrics.pop("timing", None)
    assert json.dumps(here) == json.dumps(there)


def by_number(folder, removed):
    """A trace that takes no time."""
    return {
        "verdict": "none",
        "effects": [],
        "equation": None,
        "ranking": [],
        "chi2": {"before": 1, "after": 1},
        "rms": {},
    }


def test_a_study_of_traces_is_the_same_on_a_cluster(two_workers):
    truth = {"kind": "clean", "effects": [], "equation": None, "equations": []}
    plan = [Given(Path(name), {"id": name, **truth}) for name in ("a", "b", "c")]
    here, there = (run_trace_study(plan, by_number, no_checkpoint, lambda _: None, jobs) for jobs in (1, two_workers))
    assert here.metrics["rows"] == there.metrics["rows"]


def refusal(capsys, *words):
    """The line of a command that is refused."""
    assert main(["robustness", "robustness", *words]) == 2
    out, error = capsys.readouterr()
    assert (out, error.count("\n")) == ("", 1)
    return error


def test_no_address_and_nobody_there_are_refused_in_one_line(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]
    for address in ("nowhere", "udp://127.0.0.1:1", "127.0.0.1:port", "tcp://:8786"):
        assert f"--cluster {address}: not the address of a scheduler" in refusal(capsys, "--cluster", address)
    assert "Connection refused; start `dask scheduler`" in refusal(capsys, "--cluster", f"127.0.0.1:{port}")
    assert "leave one of them out" in refusal(capsys, "--cluster", f"127.0.0.1:{port}", "--jobs", "2")
    monkeypatch.setattr(cluster_module, "find_spec", lambda name: None)
    assert "pip install 'jackbench[cluster]'" in refusal(capsys, "--cluster", f"127.0.0.1:{port}")
    assert not any(tmp_path.iterdir())


def test_code_that_is_trusted_here_is_trusted_by_the_workers(two_workers, tmp_path, monkeypatch):
    code = tmp_path / "mine.py"
    code.write_text("")
    with process_pool(two_workers, trusts) as work, pytest.raises(InputError, match="not trusted"):
        work({"a": code}, no_checkpoint, lambda _: None)
    monkeypatch.setenv("JACKBENCH_TRUSTED", "")
    trust.allow(code)
    with process_pool(two_workers, trusts) as work:
        assert work({"a": code}, no_checkpoint, lambda _: None) == ["mine.py"]
    monkeypatch.setenv("JACKBENCH_TRUSTED", "")
    with process_pool(two_workers, trusts) as work, pytest.raises(InputError, match="not trusted"):
        work({"a": code}, no_checkpoint, lambda _: None)


def trusts():
    def work(code):
        trust.check(code, code.read_bytes())
        return code.name

    return work


def test_a_worker_that_dies_costs_its_task_only(two_workers, tmp_path):
    items = {name: tmp_path / name for name in ("a", "b", "c")}
    for name in "bc":
        items[name].touch()
    with process_pool(two_workers, dies_once) as work:
        assert work(items, no_checkpoint, lambda _: None) == ["a", "b", "c"]


def test_a_task_that_ends_every_worker_ends_the_run(two_workers):
    with process_pool(two_workers, dies) as work, pytest.raises(ClusterError, match="ended 2 workers"):
        work({"a": 1}, no_checkpoint, lambda _: None)
