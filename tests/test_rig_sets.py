"""Rigs of a set: standard variations, an experiment's own, and rig files; what is refused in one line."""

from dataclasses import replace

import pytest

from workbench.base.errors import InputError
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.experiment_file import data_files
from workbench.loop.rig_variations import variation
from workbench.rigs.rig_file import load_rig, save_rig

BENCH = """
experiment = "bench"
rig = "jack-10t"
rigs = ["nominal", "beta-50", "heavy", "other.toml"]
scenarios = ["position-10mm"]
[variation.heavy]
factors = {M = 1.5, beta = 0.7}
values = {Ps = "180 bar", V0 = {value = 0.31, unit = "l"}}
[controllers.p-dp]
use = "controllers.p:P"
gain = "3.7 1/m"
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "1.6e-4 1/bar"
corner = "0.25 Hz"
[bode]
low_hz = 2
high_hz = 20
points = 3
amplitudes_percent = [1]
"""
FORCE = BENCH.replace("position-10mm", "force-20kn").replace(
    "[controllers.p-dp]",
    '[specimen]\nstiffness = "1e7 N/m"\ndamping = "1e3 N s/m"\n[controllers.p-dp]\nstiffness = "1e7 N/m"',
)


@pytest.fixture
def folder(tmp_path, rig):
    save_rig(replace(rig.with_values(M=700.0), name="jack-10t"), tmp_path / "other.toml")
    return tmp_path


def loaded(folder, text):
    (folder / "bench.toml").write_text(text)
    (loop,) = BenchConfig.load(folder / "bench.toml").loops
    return loop.rigs


def test_a_set_has_variations_of_its_own_and_rig_files_beside_standard_ones(folder, rig):
    rigs = loaded(folder, BENCH)
    assert list(rigs) == [member.name for member in rigs.values()] == ["nominal", "beta-50", "heavy", "other"]
    assert rigs["beta-50"] == variation(rig, "beta-50")
    heavy = rigs["heavy"]
    assert (heavy["M"], heavy["Ps"]) == (1500.0, 180e5)
    assert heavy["beta"] == pytest.approx(0.7e9)
    assert heavy["V0"] == pytest.approx(0.31e-3)
    assert rigs["other"]["M"] == pytest.approx(700.0)


def test_every_rig_of_a_force_loop_has_the_specimen(folder):
    assert [rig["ks"] for rig in loaded(folder, FORCE).values()] == [1e7] * 4


def test_a_set_of_each_signal_names_its_own(folder):
    text = BENCH.replace('["nominal", "beta-50", "heavy", "other.toml"]', '{position = ["heavy", "other.toml"]}')
    assert list(loaded(folder, text)) == ["heavy", "other"]


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('"heavy", ', "", "variation.heavy: is not in the list `rigs`"),
        ("variation.heavy", "variation.hevy", 'rigs: no rig "heavy" in the set'),
        ("{M = 1.5, beta", "{MM = 1.5, beta", 'toml: line 7: variation.heavy.factors.MM: unknown key; did you mean "M'),
        ("M = 1.5", "M = -1", "M = -1: must be a positive number"),
        ("M = 1.5", "Ps = 0.8", "values.Ps: has a factor too; remove one"),
        ('"180 bar"', '"180 mm"', "cannot be converted"),
        ('"180 bar"', '"9000 bar"', "rig jack-10t: Ps: 9e+08 Pa is outside"),
        ("factors = {M", "factor = {M", 'heavy.factor: unknown key; did you mean "factors"?'),
        ("other.toml", "others.toml", "others.toml: no such file"),
        ("other.toml", "heavy.toml", "heavy.toml: no such file"),
        ('rigs = ["nominal"', 'rigs = ["nominal", "nominal"', '"nominal" is listed twice'),
        ("[variation.heavy]", '[variation.mass-50]\nfactors = {M = 0.4}\n[variation.heavy]',
         "variation.mass-50: is a standard variation; choose another name"),
        ("factors = {M = 1.5, beta = 0.7}\nvalues = {Ps = \"180 bar\", V0 = {value = 0.31, unit = \"l\"}}", "",
         "variation.heavy: varies nothing"),
    ],
)  # fmt: skip
def test_a_set_that_makes_no_sense_is_refused(folder, old, new, complaint):
    assert old in BENCH
    with pytest.raises(InputError) as refused:
        loaded(folder, BENCH.replace(old, new, 1))
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


def test_two_rigs_of_one_name_are_refused(folder, rig):
    save_rig(rig, folder / "heavy.toml")
    with pytest.raises(InputError, match='two rigs are named "heavy"; rename one'):
        loaded(folder, BENCH.replace("other.toml", "heavy.toml"))


def test_a_rig_without_a_sensor_that_a_controller_needs_is_refused(folder, rig):
    sensors = {name: sensor for name, sensor in rig.sensors.items() if name != "pa"}
    save_rig(replace(rig, sensors=sensors), folder / "other.toml")
    with pytest.raises(InputError, match="rigs: other has no pa sensor, which p-dp needs"):
        loaded(folder, BENCH)


def test_a_scenario_out_of_one_rig_s_reach_is_refused_with_its_name(folder, rig):
    limits = {**rig.limits, "stroke": replace(rig.limits["stroke"], value=8e-3)}
    save_rig(replace(rig, limits=limits), folder / "other.toml")
    with pytest.raises(InputError, match="a position of 10 mm, the limit of other is 8 mm"):
        loaded(folder, BENCH)


def test_a_file_s_path_counts_from_the_experiment(folder, monkeypatch):
    monkeypatch.chdir("/")
    assert load_rig("jack-10t").name == "jack-10t"
    assert loaded(folder, BENCH)["other"]["M"] == pytest.approx(700.0)


def test_a_bench_does_not_resume_on_another_file_s_numbers(folder):
    (folder / "bench.toml").write_text(BENCH)
    source = BenchConfig.load(folder / "bench.toml").source
    before = data_files(source)
    assert list(before) == [str(folder / "other.toml")]
    save_rig(load_rig("jack-10t"), folder / "other.toml")
    assert data_files(source) != before
