"""A pump drive: flows, stores and loads by hand; its rig file; records with further inputs; its measured campaign."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_pumps import driven_by_speed, oil_beyond_motion, poles_of_steady_points, run

from workbench.base.checkpoint import no_checkpoint
from workbench.base.errors import InputError
from workbench.commands.residual.study import run_residual
from workbench.engine import Engine
from workbench.identify.fit.windows import predicted
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import find
from workbench.plant.valve import VALVES
from workbench.records import Record, centred_means, load_campaign
from workbench.rigs.rig_file import load_rig, save_rig

MEASURED = Path(__file__).parents[1].parent / "shared" / "data" / "pump_rig"
needs_records = pytest.mark.skipif(not MEASURED.is_dir(), reason="the recordings of ../shared are not here")


@pytest.fixture(scope="module")
def rig():
    return load_rig("pump-rig")


@pytest.fixture(scope="module")
def driven(rig):
    """Plant and engine of the rig driven by a measured speed."""
    return driven_by_speed(rig)


def test_the_published_numbers_are_as_published(rig):
    assert (rig["AA"], rig["AB"]) == pytest.approx((19.635e-4, 16.493e-4))
    assert rig["D"] * 2 * np.pi == pytest.approx(1.6e-6)
    assert rig["D"] * rig["nmax"] - rig["Cp"] * 250e5 == pytest.approx(0.92 * rig["D"] * rig["nmax"], rel=1e-3)
    assert not rig.effects


def test_a_rig_file_reads_back(rig, tmp_path):
    save_rig(rig, tmp_path / "again.toml")
    assert load_rig(tmp_path / "again.toml").table() == rig.table()


def test_another_corrector_has_its_own_numbers(rig):
    assert "Rm" not in rig.with_corrector("speed").numbers
    with pytest.raises(InputError, match=r'no corrector "sped"; did you mean "speed"'):
        rig.with_corrector("sped")
    with pytest.raises(InputError, match="corrector motor needs Um, which the rig file lacks"):
        rig.with_corrector("speed").with_corrector("motor")


@pytest.mark.parametrize(("direction", "area"), [(1.0, "AA"), (-1.0, "AB")])
def test_the_speed_is_what_the_pump_gives_over_the_area(driven, rig, direction, area):
    _, x, y = run(driven, 1.0, command=0.4 * direction, direction=direction)
    given = rig["D"] * 0.4 * rig["nmax"] - rig["Cp"] * (x["Pd"][-1] - x["P0"][-1])
    assert x["v"][-1] == pytest.approx(direction * given / rig[area], rel=1e-3)
    assert y["pump_speed"][-1] == pytest.approx(direction * 0.4 * rig["nmax"])


def test_without_a_direction_the_sign_of_the_command_chooses_the_chamber(driven):
    told, own = (run(driven, 0.5, command=-0.3, **further)[1] for further in ({"direction": -1.0}, {}))
    assert own["x"] == pytest.approx(told["x"], abs=1e-9)


def test_shut_direction_valves_hold_the_jack(driven):
    _, x, _ = run(driven, 5.0, command=0.0, direction=0.0)
    assert abs(x["v"][-1]) < 1e-6
    assert x["oa"][-1] == pytest.approx(0, abs=1e-9)


def test_a_direction_valve_switches_in_its_time(driven, rig):
    t, x, _ = run(driven, 0.1, command=0.3, direction=1.0)
    assert x["oa"] == pytest.approx(1 - np.exp(-t / rig["td"]), abs=1e-4)


def test_no_oil_is_lost(driven, rig):
    """What leaves the accumulator is the rod's volume, and what the pressures press together."""
    _, x, _ = run(driven, 1.0, command=0.5, direction=1.0)
    oil, moved = oil_beyond_motion(rig, x)
    assert np.ptp(oil[20:]) < 0.01 * np.ptp(moved)


def test_a_tank_keeps_its_pressure(rig):
    tank = rig.with_values(Vg=10.0).with_corrector("speed")
    plant = build(tank)
    _, x, _ = run((plant, Engine(plant, 1e-7)), 1.0, command=0.5, direction=1.0)
    assert np.ptp(x["Pg"]) < 0.01e5


def test_compliant_hoses_delay_the_start(rig):
    soft = rig.with_values(ChA=2e-12).with_corrector("speed")
    plant = build(soft)
    moved = [
        run((p, Engine(p, 1e-7)), 0.5, command=0.5, direction=1.0, load_setting=40e5)[1]["x"][-1]
        for p in (build(rig.with_corrector("speed")), plant)
    ]
    assert 0 < moved[1] < moved[0]


def test_the_loading_cylinder_pushes_back_while_extending(driven, rig):
    set_pressure = 40e5
    for direction, pushed in ((1.0, 1.0), (-1.0, 0.0)):
        _, x, _ = run(driven, 1.0, command=0.3 * direction, direction=direction, load_setting=set_pressure)
        pressed = rig["AA"] * x["P1"][-1] - rig["AB"] * x["P2"][-1] - rig["b"] * x["v"][-1]
        assert pressed == pytest.approx(pushed * rig["AL"] * set_pressure, abs=20)


def test_the_relief_valve_opens_at_its_setting(driven, rig):
    """On the end stop, less what the pump leaks."""
    _, x, _ = run(driven, 5.0, command=0.6, direction=1.0)
    given = 0.6 * rig["D"] * rig["nmax"] - rig["Cp"] * (x["Pd"][-1] - x["P0"][-1])
    assert x["Pd"][-1] == pytest.approx(rig["Ps"] + given / rig["Kr"], rel=1e-3)


def test_a_motor_stands_where_its_torques_balance(rig):
    motor = rig.with_corrector("motor")
    plant = build(motor)
    point = equilibrium(plant, command=0.6)
    x = dict(zip([state.name for state in plant.states], point.x, strict=True))
    drop = x["Pd"] - x["P0"]
    torque = rig["km"] * (0.6 * rig["Um"] - rig["km"] * x["w"]) / rig["Rm"]
    assert torque == pytest.approx(rig["T0"] + (rig["D"] + rig["Tp"]) * drop, rel=1e-6)


def test_the_speed_loop_brings_the_shaft_to_its_command(rig):
    plant = build(rig)
    _, x, _ = run((plant, Engine(plant)), 1.0, command=0.5, direction=1.0)
    assert x["w"][-1] == pytest.approx(0.5 * rig["nmax"], rel=0.01)


@pytest.mark.parametrize("corrector", ["speed", "motor", "speed-loop"])
def test_operating_points_and_their_linear_models(rig, corrector):
    """At rest a valve is just open, or shut where the speed is measured; a store that fills on the way is held."""
    for speed, poles in poles_of_steady_points(rig, corrector):
        assert poles[-1] < 1e-9
        if corrector != "speed" or speed:
            assert poles[-2] < -1e-6  # all decay but the position


@pytest.mark.parametrize("command", [1.0, 0.3, -0.3, -1.0])
@pytest.mark.parametrize("also", [(), ("selector.delay", "load.compliance", "hose.compliance", "pump.leakage")])
def test_past_a_load_that_slips_it_moves_as_fast_as_in_a_simulation(rig, command, also):
    """At rest such a load holds any force: a search could end there, or where a pressure has gone."""
    slips = find("load.buildup", "gap and slip"), *(find(name, "") for name in also)
    plant = build(rig, slips)
    steady = equilibrium(plant, command=command, p=plant.without_dry_friction()).speed
    t = 1e-3 * np.arange(801)
    u = np.zeros((800, len(plant.inputs)))
    u[:, plant.input("command")] = command
    moved = Engine(plant).run(plant.start, t, u)
    assert steady == pytest.approx(moved.x[-1, plant.state("v")], rel=0.01)


def test_a_shaft_speed_is_a_measurement_unless_it_is_the_command(rig):
    signals = [predicted(build(rig.with_corrector(name))) for name in ("speed", "motor", "speed-loop")]
    assert ["pump_speed" in each for each in signals] == [False, True, True]


def test_a_pump_has_no_pilot(rig):
    assert not VALVES["pump"].kind.has_pilot
    assert not rig.is_throttled


def test_centred_means_neither_lead_nor_lag():
    t = 1e-3 * np.arange(200)
    record = Record("r", t, {"command": np.where(t < 0.1, 0.0, 1.0), "position": t})
    mean = centred_means(record, 20)
    assert mean.t == pytest.approx(t[::20])
    assert mean.signals["position"][1:] == pytest.approx(mean.t[1:] - 0.5e-3)
    assert mean.signals["command"].tolist() == [0.0] * 5 + [1.0] * 5


def campaign_folder(folder, **keys):
    """A campaign of one record at two settings of the load."""
    rows = "\n".join(f"{1e-3 * k:g},{0.1 * (k % 7):g},{1 if k % 2 else -1},{k % 5}" for k in range(100))
    head = "t [s],command [1],direction [1],current [count]"
    (folder / "a.csv").write_text(f"{head}\n{rows}\n")
    (folder / "b.csv").write_text(f"{head}\n{rows}\n0.1,0.5,1,3\n")
    more = "\n".join(f"{key} = {value}" for key, value in keys.items())
    records = '[records]\ntrain = [{file = "a.csv", load_setting = "20 bar"}]\nheldout = ["b.csv"]\n'
    (folder / "campaign.toml").write_text(f'rig = "pump-rig"\nunused = ["current"]\n{more}\n{records}')
    return folder


def test_a_record_carries_further_inputs_and_constants(tmp_path):
    campaign = load_campaign(campaign_folder(tmp_path))
    (record,) = campaign.train
    assert set(record.names) == {"command", "direction", "load_setting"}
    assert set(record.signals["load_setting"]) == {20e5}
    assert "load_setting" not in campaign.heldout[0].signals


def test_a_campaign_may_be_read_in_means(tmp_path):
    campaign = load_campaign(campaign_folder(tmp_path, mean='"10 ms"', corrector='"speed"'))
    assert campaign.train[0].period == pytest.approx(10e-3)
    assert campaign.corrector == "speed"


def test_a_setting_is_a_pressure(tmp_path):
    folder = campaign_folder(tmp_path)
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace("20 bar", "20 mm"))
    with pytest.raises(InputError, match="load_setting"):
        load_campaign(folder)


@needs_records
def test_the_measured_records_need_no_campaign_file():
    campaign = load_campaign(MEASURED)
    assert [len(records) for records in (campaign.train, campaign.select, campaign.heldout)] == [3, 1, 2]
    assert {float(record.signals["load_setting"][0]) for record in campaign.train} == {0.0, 20e5, 40e5}
    assert np.ptp(campaign.heldout[0].signals["direction"]) == 2.0


@needs_records
def test_the_published_numbers_run_through_whole_cycles(rig):
    campaign = load_campaign(MEASURED)
    driven = rig.with_corrector(campaign.corrector)
    short = replace(campaign, heldout=campaign.heldout[:1])
    rows = run_residual(short, driven, no_checkpoint, lambda _: None).metrics["rows"]
    rms = {row["signal"]: row["rms"] for row in rows}
    assert 1 < rms["position"] < 10  # mm
    assert 2 < rms["pb"] < 10  # bar


@pytest.mark.skipif(not MEASURED.exists(), reason="the recordings are not shipped")
def test_the_measured_folder_is_known_by_its_records_whatever_its_name(tmp_path: Path):
    renamed, fewer = tmp_path / "our-rig", tmp_path / "pump_rig"
    for folder in (renamed, fewer):
        folder.mkdir()
        for path in sorted(MEASURED.glob("*.csv.gz"))[: None if folder is renamed else 3]:
            (folder / path.name).symlink_to(path)
    assert load_campaign(renamed).rig == "pump-rig"
    with pytest.raises(InputError, match=r"campaign\.toml"):
        load_campaign(fewer)
