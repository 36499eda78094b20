"""What a rig can do: bounds by formulas, the engine inside and outside of them, power, gas law, sizing, and sheets."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from made_loops import run_loop

from workbench.cli import main
from workbench.commands.capability.platform import leg_loops
from workbench.commands.common.sheet_page import undated
from workbench.control.controller_type import controller
from workbench.control.platform_controller import PlatformSpec
from workbench.identify.acceptance.bench import TestBench as Bench
from workbench.loop.capability import capability, stall_force
from workbench.loop.drive_simulation import drive
from workbench.loop.performance.bounds import Drive, envelope, weakest
from workbench.loop.performance.carried import carried_along, carried_by_jack, inertia
from workbench.loop.performance.drive import (
    CataloguePump,
    CatalogueValve,
    accumulator,
    demands,
    lacking,
    pump_choices,
    smallest,
    valve_choices,
)
from workbench.loop.performance.reached import followed, reached
from workbench.loop.platform.reached import reached_along
from workbench.loop.platform.rows import followed_along
from workbench.loop.platform.setup import platform_setup
from workbench.loop.rows import linear_loops, loop_setup
from workbench.plant.valve.supply import supply_power
from workbench.records import Record
from workbench.records.record import write_csv
from workbench.rigs.platform import leg_speeds, load_platform
from workbench.rigs.rig_file import load_rig, rig_text

OPEN = Drive(np.array([1.0, 1e3]), np.ones(2))  # a valve that follows full command for ever


def bounded(rig, *f, drive=OPEN):
    return envelope(carried_by_jack(rig, np.array(f)), drive)


def test_a_mass_is_bound_by_the_supply_s_force_and_a_slow_jack_by_its_flow():
    rig = load_rig("jack-10t")
    own = bounded(rig, 20.0)
    assert own.bounds["supply"][0] * rig["M"] * (2 * np.pi * 20) ** 2 == pytest.approx(stall_force(rig, 1.0), rel=2e-3)
    slow = rig.with_values(K3=rig["K3"] / 20)
    own = bounded(slow, 0.5)
    assert own.binding == ["flow"]
    assert own.amplitude[0] * 2 * np.pi * 0.5 == pytest.approx(capability(slow).v0, rel=0.01)


def test_a_command_that_changes_slowly_opens_the_lands_less():
    rig = load_rig("jack-10t")
    rig = rig.with_values(K3=rig["K3"] / 20)
    own = bounded(rig, 100.0)
    rate = rig.limit("command_rate") / (2 * np.pi * 100)
    assert own.bounds["command rate"][0] == pytest.approx(rate * own.bounds["flow"][0], rel=0.03)
    assert own.binding == ["command rate"]


def test_a_pump_gives_the_mean_of_what_a_cycle_takes():
    rig = load_rig("jack-10t").with_values(eps=1e-8)
    own = bounded(rig, 1.0, drive=Drive(OPEN.f, OPEN.response, pump=1e-3))
    mean = 4 * rig["Aj"] * own.bounds["pump"][0] * 1.0  # each way sweeps twice the amplitude
    assert mean == pytest.approx(1e-3, rel=0.02)


@pytest.mark.parametrize(
    ("name", "f"), [("jack-10t", 15.0), ("festo-tp511", 6.0), ("festo-tp511", 15.0), ("festo-tp511", 20.0)]
)
def test_the_engine_reaches_what_is_inside_and_not_what_is_outside(name, f):
    rig = load_rig(name)
    response = Bench(rig, 0).response("main", 100)
    own = bounded(rig, f, drive=Drive(response.f, response.response))
    setup, slow = loop_setup(rig), drive(rig).loop
    inside, outside = (reached(setup, slow, f, share * own.amplitude[0], own.binding[0]) for share in (0.95, 1.1))
    assert inside.there
    assert not outside.there


@pytest.fixture(scope="module")
def hexapod():
    return platform_setup(load_platform("hexapod"))


@pytest.mark.parametrize("axis", ["surge", "roll"])
def test_the_engine_moves_a_platform_as_far_as_its_envelope_says(hexapod, axis):
    f, loops = 12.0, leg_loops(hexapod).slow
    response = Bench(hexapod.guarded[0], 0).response("main", 100)
    legs = carried_along(hexapod, axis, np.array([f]))
    own = weakest([envelope(leg, Drive(response.f, response.response)) for leg in legs])
    inside, outside = (
        reached_along(hexapod, loops, axis, f, share * float(own.amplitude[0]), own.binding[0]) for share in (0.95, 1.1)
    )
    assert inside.there
    assert not outside.there


def test_legs_that_tune_themselves_follow_slow_heave_and_no_fast_one(hexapod):
    period = hexapod.platform.period
    controller = PlatformSpec("automatic", tuple(leg_loops(hexapod).tuned)).build(period, hexapod.directions)
    found = followed_along(hexapod, controller, "heave", np.array([0.5, 50.0]), np.array([0.02, 0.001]))
    assert found.amplitude[0] == pytest.approx(0.9 * 0.02)
    assert np.isnan(found.amplitude[1])


def test_without_a_position_sensor_no_loop_is_played_and_the_engine_is_asked_all_the_same(tmp_path):
    rig = load_rig("jack-10t")
    blind = replace(rig, sensors={name: sensor for name, sensor in rig.sensors.items() if name != "position"})
    (tmp_path / "blind.toml").write_text(rig_text(blind))
    assert main(["capability", str(tmp_path / "blind.toml"), "--out", str(tmp_path / "out")]) == 0
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    unsaid = {row["id"]: row["reason"] for row in metrics["rows"] if row["value"] is None}
    assert set(unsaid) == {"followed_amplitude", "followed_error", "followed_control"}
    assert all("position sensor" in reason for reason in unsaid.values())
    assert {point["there"] for point in metrics["reached"]} == {True, False}


def test_a_leg_s_envelope_goes_through_the_jacobian(hexapod):
    """Heave of a platform: six legs alike share its inertia, on top of its weight."""
    setup = hexapod
    legs = carried_along(setup, "heave", np.array([5.0]))
    own = weakest([envelope(leg, OPEN) for leg in legs])
    along = leg_speeds(setup.platform.geometry, np.zeros(6))[0, 2]
    assert own.bounds["stroke"][0] == pytest.approx(legs[0].rig.limit("stroke") / along, rel=1e-6)
    weight = sum(leg.held for leg in legs) * along
    assert weight == pytest.approx(9.81 * inertia(setup)[2, 2], rel=0.05)  # of a leg a part hangs on its base
    most = 6 * along * stall_force(legs[0].rig, 1.0) - weight
    assert own.bounds["supply"][0] * (2 * np.pi * 5) ** 2 * inertia(setup)[2, 2] == pytest.approx(most, rel=1e-3)


def test_a_stiff_loop_follows_slow_sines_and_no_fast_ones():
    rig = load_rig("jack-10t")
    setup, spec = loop_setup(rig), controller("controllers.p:P", gain=0.2)
    own = followed(setup, spec, linear_loops(spec, setup), np.array([1.0, 50.0]), np.array([0.05, 5e-3]))
    assert np.isnan(own.error[0])  # late by more than 5 % of a cycle over 2 pi
    assert np.isnan(own.amplitude[1])
    assert own.control[0] == 0.05


@pytest.fixture(scope="module")
def need():
    rig = load_rig("jack-10t")
    t = np.arange(4000) * rig.period.value
    fade = np.clip(np.minimum(t, t[-1] - t) / 0.5, 0, 1)
    return demands(rig, 0.04 * fade * np.sin(4 * np.pi * t))


def test_power_of_a_drive_file_is_what_the_engine_draws_on_it(need):
    setup = loop_setup(need.rig)
    loop = controller("controllers.p:P", gain=3.0).build(need.rig.period.value)
    run = run_loop(setup.engine, need.rig, loop, setup.null, need.rig.middle + need.position).record.signals
    again = demands(need.rig, run["position"] - need.rig.middle)
    drawn = supply_power(need.rig, *(run[name] for name in ("spool", "pa", "pb", "supply")))
    assert float(again.power.mean()) == pytest.approx(float(drawn.mean()), rel=0.01)
    assert again.heat == pytest.approx(float(np.mean(drawn - run["jack_force"] * run["velocity"])), rel=0.01)


def test_what_goes_round_leaves_all_of_its_power_in_the_oil(need):
    lost = need.rig["b"] * np.mean(need.speed**2)
    assert float(need.power.mean()) - need.heat == pytest.approx(lost, rel=0.02)


def test_an_accumulator_obeys_the_gas_law_and_a_pump_below_the_mean_needs_none_that_helps():
    gas, low = accumulator(1e-3, 210e5, 0.1), 0.9 * 210e5
    first = 0.9 * low * gas**1.4  # p V^1.4 of the precharge
    empty, full = ((first / p) ** (1 / 1.4) for p in (low, 210e5))
    assert empty - full == pytest.approx(1e-3)
    flow = np.where(np.arange(1000) % 500 < 100, 1e-3, 0.0)  # 0.1 s of 1 l/s, twice a second
    assert lacking(flow, 1e-3, 2.5e-4) == pytest.approx(0.1 * 7.5e-4, rel=1e-6)
    assert lacking(flow, 1e-3, 1e-3) == 0.0
    assert lacking(flow, 1e-3, 1e-4) is None


def test_the_smallest_valve_and_pump_that_suffice_are_named_and_by_what_the_others_fail(need):
    rated = float(need.lands.opening.max()) * need.rig["K3"] * need.rig["z3max"] * np.sqrt(35e5)
    valves = [
        CatalogueValve("large", 4 * rated, 70e5, 100.0),
        CatalogueValve("small", 0.9 * rated, 70e5, 100.0),
        CatalogueValve("slow", 1.2 * rated, 70e5, 1.0),
        CatalogueValve("right", 1.3 * rated * 2**-0.5, 35e5, 100.0),
    ]
    choices = valve_choices(need, valves)
    assert [(each.entry.name, each.fails) for each in choices] == [
        ("small", "flow"), ("slow", "bandwidth"), ("right", ""), ("large", "")
    ]  # fmt: skip
    mean = float(need.flow.mean())
    pumps = pump_choices(need, [CataloguePump("b", 1.2 * mean), CataloguePump("a", 0.9 * mean)], 0.1)
    assert [(each.entry.name, each.fails) for each in pumps] == [("a", "mean flow"), ("b", "")]
    assert smallest(pumps) is pumps[1]
    assert pumps[1].accumulator is not None
    assert pumps[1].accumulator > 0


def test_a_force_beyond_the_supply_s_is_no_matter_of_the_valve(need):
    small = need.rig.with_values(Aj=need.rig["Aj"] / 20)
    choices = valve_choices(demands(small, need.position, band=20.0), [CatalogueValve("any", 1.0, 70e5, 100.0)])
    assert choices[0].fails == "supply"


@pytest.fixture
def course(tmp_path):
    t = np.arange(0, 4, 0.01)
    rows = [f"{a:.3f},{b:.4f}" for a, b in zip(t, 30 * np.sin(2 * np.pi * t) ** 2, strict=True)]
    path = tmp_path / "course.csv"
    path.write_text("\n".join(["t [s],position [mm]", *rows]))
    return path


def test_one_command_twice_gives_the_same_files(course, tmp_path):
    out, kept = tmp_path / "out", []
    words = ["--drive", str(course), "--catalogue", "docs/files/catalogue.toml", "--cooler", "1 W", "--force"]
    for _ in range(2):
        assert main(["capability", "crane", *words, "--out", str(out)]) == 0
        kept.append({path.name: path.read_bytes() for path in out.iterdir() if path.is_file()})
    assert kept[0] == kept[1]
    metrics = json.loads(kept[0]["metrics.json"])
    heat = next(row for row in metrics["rows"] if row["id"] == "heat")
    assert heat["pass"] is False
    assert {each["name"] for each in metrics["valves"]} == {"D63", "D100"}


def test_a_pdf_has_no_date_but_the_one_that_is_written_on_it():
    made = b"1 0 obj <</Creator (x)\n/CreationDate (D:20260101120000+00'00')\n/ModDate (D:20260101120000+00'00')>>"
    other = made.replace(b"20260101", b"20270202")
    assert undated(made) == undated(other)
    assert len(undated(made)) == len(made)  # the places that its table of contents says stay


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no Chromium that prints")
def test_a_pdf_is_printed_again_to_the_byte(tmp_path):
    from workbench.commands.common.sheet_page import print_pdf

    page = tmp_path / "page.html"
    page.write_text("<p>sheet</p>")
    for name in ("a.pdf", "b.pdf"):
        print_pdf(page, tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_measured_sines_stand_beside_the_envelope(tmp_path):
    t = np.arange(12000) * 1e-3
    slow, fast = 0.02 * np.sin(4 * np.pi * t), 5e-3 * np.sin(16 * np.pi * t)
    size = np.where((t > 1) & (t < 7), slow, np.where(t > 8, fast, 0.0))
    record = Record("sines", t, {"command": 0.1 * size, "position": size})
    write_csv(record, tmp_path / "sines.csv")
    (tmp_path / "campaign.toml").write_text('rig = "jack-10t"\n[records]\nheldout = ["sines.csv"]\n')
    out = tmp_path / "out"
    assert main(["capability", "jack-10t", "--campaign", str(tmp_path), "--out", str(out)]) == 0
    measured = json.loads((out / "metrics.json").read_text())["measured"]
    assert [round(each["f"], 2) for each in measured] == [2.0, 8.0]
    assert [each["amplitude"] for each in measured] == pytest.approx([0.02, 5e-3], rel=1e-3)
    assert measured[0]["share"] == pytest.approx(0.02 / 0.24, rel=0.01)
    assert "measured, sines" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["pump-rig"], "lands"),
        (["crane", "--cooler", "20 kW"], "--drive"),
        (["crane", "--pump", "20 kW"], "--pump 20 kW"),
        (["crane", "--campaign", "experiments/sample"], "--campaign: no record with sines"),
        (["hexapod", "--pump", "100 l/min"], "platform"),
        (["crane", "--drive", "nowhere.csv"], "nowhere.csv"),
        (["crane", "--loop", "position_tuned", "--controller", "nobody"], "nobody"),
    ],
)
def test_bad_input_is_one_line(words, told, tmp_path, capsys):
    assert main(["capability", *words, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert told in error
    assert not (tmp_path / "out").exists()


def test_a_course_beyond_the_stroke_is_refused(course, tmp_path, capsys):
    course.write_text("t [s],position [mm]\n0,0\n1,5000\n")
    assert main(["capability", "crane", "--drive", str(course), "--out", str(tmp_path / "out")]) == 2
    assert "from mid stroke" in capsys.readouterr().err
