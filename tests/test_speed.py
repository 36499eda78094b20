"""The speed study, thin: its keys, and that what it compares is equally accurate; how fast is not tested."""

import pytest

from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.speed import loops, study as speed


@pytest.fixture(scope="module")
def metrics(rig):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(speed, "BATCHES", (1, 3))
        for timed in (speed, loops):
            patch.setattr(timed, "_REPEATS", 1)
        patch.setattr(loops, "LANES", 20)
        patch.setattr(speed, "PEERS", {"CasADi CVODES": speed.PEERS["CasADi CVODES"]})
        patch.setattr(
            speed, "_environments", lambda: [{"name": "none", "steps_per_second": 1.0, "cpu_us_per_step": 1.0}]
        )
        return speed.run_speed(rig, no_checkpoint, lambda _: None).metrics


def test_rows_have_the_contract_s_keys(metrics):
    assert {"peers", "batch", "envs", "start"} <= metrics.keys()
    assert {"version_cpu_s", "numpy_cpu_s"} <= metrics["start"].keys()
    for row in metrics["peers"]:
        assert {"name", "ms_per_simulated_second", "error", "times_ours"} <= row.keys()
    for row in metrics["batch"]:
        assert {"plants", "simulated_seconds_per_second", "share_of_floor"} <= row.keys()
    assert all({"name", "steps_per_second"} <= row.keys() for row in metrics["envs"])


def test_every_solver_is_as_accurate_as_it_is_said_to_be(metrics):
    assert [row["name"] for row in metrics["peers"]] == ["jackbench", "jackbench interpreted", "CasADi CVODES"] * 2
    for row in metrics["peers"]:
        assert 0 < row["error"] <= speed.ERROR, row
