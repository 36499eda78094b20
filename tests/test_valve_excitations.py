"""What a valve's sheet needs: designed, played on the bench, read back into a whole sheet; what is missing is named."""

import json

import numpy as np
import pytest

from workbench.cli import main
from workbench.engine import Engine
from workbench.identify.acceptance.excitations import VALVE_TELLS, missing_records
from workbench.identify.acceptance.row import Row
from workbench.linear import equilibrium
from workbench.plant import build_blocked_valve, build_valve_bench
from workbench.records import Record
from workbench.records.excitation import read_excitation
from workbench.records.record import write_csv
from workbench.rigs.rig_file import load_rig

NEVER = ("null_shift", "pilot", "main_small")  # lines of two supplies, of the pilot by itself, and of a whole rig


def played(rig, wave):
    """The record of a bench without noise."""
    plant = build_blocked_valve(rig) if wave.name == "valve-pressure" else build_valve_bench(rig)
    t, u = wave.t, wave.command[:, None]
    run = Engine(plant).run(
        equilibrium(plant, command=0.0).x, np.append(t, t[-1] + wave.period), np.append(u, u[-1:], axis=0)
    )
    seen = plant.observe(run.x[:-1], u)
    names = [name for name in ("spool", "flow", "pa", "pb") if name in plant.outputs]
    return Record(wave.name, t, {"command": wave.command, **{name: seen[:, plant.output(name)] for name in names}})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("excite") / "valve"
    assert main(["excite", "jack-10t", "valve-test", "--out", str(out)]) == 0
    return out


def test_a_folder_has_every_record_of_a_test(folder):
    assert {path.stem for path in folder.iterdir()} == set(VALVE_TELLS)


def test_played_on_a_bench_they_tell_every_line_that_a_bench_can(folder, tmp_path):
    rig, names = load_rig("jack-10t"), []
    for path in sorted(folder.iterdir()):
        record = played(rig, read_excitation(path, rig.period.value, rig["xmid"]))
        write_csv(record, tmp_path / path.name)
        names.append(f'"{path.name}"')
    (tmp_path / "campaign.toml").write_text(f'rig = "jack-10t"\n[records]\nheldout = [{", ".join(names)}]\n')
    assert main(["valve-test", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    unsaid = [row["id"] for row in metrics["rows"] if row["value"] is None]
    assert metrics["missing"] == []
    assert all(id.startswith(NEVER) for id in unsaid)
    found = {row["id"]: row["value"] for row in metrics["rows"]}
    assert found["main_100_f3db"] == pytest.approx(70.26, rel=0.02)
    assert found["main_flow"] == pytest.approx(599.7, rel=2e-3)


def test_a_campaign_without_them_hears_which_are_missing(tmp_path):
    """Records of a whole rig tell the curve about null, and the rated flow only where they open the valve fully."""
    assert main(["valve-test", "experiments/sample", "--out", str(tmp_path / "out")]) == 0
    missing = json.loads((tmp_path / "out" / "metrics.json").read_text())["missing"]
    assert missing == list(VALVE_TELLS)  # valve-flow-null for the threshold alone
    assert "valve-sine-25" in (tmp_path / "out" / "report.html").read_text()


def test_a_record_is_missing_as_long_as_a_line_of_it_is_open():
    open_line, said = Row("step_10_t90", "", "s", reason="none"), Row("lap", "", "%", 1.0, 0.9, 1.1)
    assert missing_records([open_line, said], VALVE_TELLS) == {"valve-step-10": ["step_10_t90"]}


def test_a_plan_leaves_the_files_of_the_records_that_a_sheet_misses(tmp_path):
    assert main(["plan", "experiments/sample", "--for", "valve-test", "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    told = {row["record"]: row["lines"] for row in metrics["missing"]}
    assert told["valve-flow"] == ["main_flow"]
    assert {path.stem for path in (tmp_path / "out").glob("*.csv")} == set(told)
    assert [row["id"] for row in metrics["beyond"]] == ["null_shift_supply", "null_shift_temperature"]
    assert metrics["said"] + sum(map(len, told.values())) + len(metrics["beyond"]) == metrics["lines"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["jack-10t", "steps", "--seconds", "5"], "--amplitude: missing"),
        (["jack-10t", "valve-test", "--amplitude", "0.1"], "--amplitude"),
        (["pump-rig", "valve-test"], "no valve with lands"),
    ],
)
def test_bad_input_is_one_line(words, told, tmp_path, capsys):
    assert main(["excite", *words, "--out", str(tmp_path / "x.csv")]) == 2
    assert told in capsys.readouterr().err.strip().splitlines()[-1]
    assert not list(tmp_path.iterdir())
