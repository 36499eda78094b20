"""The study's campaigns on a pump drive: what is played, wrong numbers as truth and as answer, the plan."""

import json
from collections import Counter

import numpy as np
import pytest

from experiments.studies.trace.__main__ import main
from experiments.studies.trace.campaigns.cause import (
    LIBRARY_CAUSES,
    OTHER_FORMULA_CAUSES,
    UNNAMED_CAUSES,
    causes_on,
    number_causes,
)
from experiments.studies.trace.campaigns.cycles import PERIOD, cycles
from experiments.studies.trace.campaigns.draw import CampaignPlan, draw
from experiments.studies.trace.plan import PUMP_SHARES, default_plan
from experiments.studies.trace.score import judged, scores
from workbench.engine import Engine
from workbench.identify.data.noise_floor import noise_floor
from workbench.identify.fit.predict import predict_windows
from workbench.plant import build
from workbench.plant.effects import applies
from workbench.records import load_campaign
from workbench.rigs.rig_file import load_rig

AREA = (("number.AB", "less"),)
SAID = {"effects": [], "equation": None, "ranking": [], "chi2": {"before": 9.0, "after": 1.0}, "rms": {}}


@pytest.fixture(scope="module")
def rig():
    return load_rig("pump-rig")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn") / "area"
    return folder, draw(CampaignPlan(31, "number", AREA, rig="pump-rig", corrector="speed"), folder)


def test_a_campaign_is_read_as_a_recorded_one_is(drawn):
    campaign = load_campaign(drawn[0])
    assert (campaign.rig, campaign.corrector) == ("pump-rig", "speed")
    assert [len(records) for records in (campaign.train, campaign.select, campaign.heldout)] == [2, 1, 1]
    assert {float(record.signals["load_setting"][0]) for record in campaign.train} & {0.0}
    for record in campaign.train:
        assert set(record.names) == {"command", "direction", "load_setting", "reference", "pa", "pb", "position"}
        assert set(np.sign(record.signals["command"])) == {-1.0, 0.0, 1.0}
        assert np.array_equal(np.sign(record.signals["command"]), record.signals["direction"])


def test_at_its_true_numbers_the_rig_leaves_noise_and_at_those_described_it_does_not(drawn, rig):
    campaign = load_campaign(drawn[0])
    driven, floor = rig.with_corrector("speed"), noise_floor(campaign)
    left = []
    for numbers in (drawn[1]["true"], drawn[1]["true"] | {"AB": rig["AB"]}):
        prediction = predict_windows(build(driven.with_values(**numbers)), campaign.heldout[0], floor)
        errors = [(prediction.error(name) / floor.sigma[name]) ** 2 for name in prediction.signals]
        left.append(float(np.nanmean(errors)))
    assert left[0] < 1.2
    assert left[1] > 2.0


def test_a_wrong_number_is_beyond_its_range(drawn, rig):
    truth = drawn[1]
    assert truth["true"]["AB"] < rig.numbers["AB"].low
    described = rig.with_corrector("speed").numbers.values()
    others = [number for number in described if number.low is not None and number.name != "AB"]
    assert all(number.low <= truth["true"][number.name] <= number.high for number in others)
    assert truth["rig"] == "pump-rig"


def test_a_number_has_the_sides_that_have_room(rig):
    sides = Counter(cause.effect.name for cause in number_causes(rig))
    assert sides["number.AB"] == 2
    assert sides["number.kg"] == 1  # no gas has less than an isothermal exponent
    for cause in number_causes(rig):
        (by,) = cause.effect.numbers
        assert (by.typical > 0) == (cause.effect.formula == "more")
        assert by.low <= by.typical <= by.high


def test_cycles_rest_then_go_out_and_back_twice():
    for cycle in cycles(np.random.default_rng(3)):
        assert cycle.period == PERIOD
        assert not cycle.reference[cycle.t < 2.39].any()
        assert np.abs(np.diff(cycle.reference)).max() == pytest.approx(12.5e-3 * PERIOD)
        assert cycle.reference[-1] == 0.0
        assert np.count_nonzero(np.diff(np.sign(np.diff(cycle.reference))) != 0) >= 7


def test_a_plan_has_its_shares_and_the_motor_where_that_is_in_question(rig):
    plan = default_plan(100, 5, "pump-rig")
    assert Counter(item.kind for item in plan) == {kind: round(100 * share) for kind, share in PUMP_SHARES.items()}
    assert {item.rig for item in plan} == {"pump-rig"}
    named = {item.effects[0][0] for item in plan if item.kind == "single"}
    assert named == {cause.effect.name for cause in causes_on(rig, LIBRARY_CAUSES)}
    by_motor = {item.effects[0][0] for item in plan if item.corrector == "motor"}
    assert by_motor == {"motor.losses"}
    assert plan == default_plan(100, 5, "pump-rig") != default_plan(100, 6, "pump-rig")


OWN = [
    cause
    for cause in (*OTHER_FORMULA_CAUSES, *UNNAMED_CAUSES)
    if applies(cause.effect, load_rig("pump-rig")) and not applies(cause.effect, load_rig("jack-10t"))
]


def travelled(rig, also):
    """Position and pressures of a stroke out against a load and back."""
    plant = build(rig, also=also)
    t = np.linspace(0, 3, 301)
    u = np.zeros((len(t), len(plant.inputs)))
    u[:, plant.input("command")] = np.where(t < 2, 0.6, -0.6)
    u[:, plant.input("direction")] = np.sign(u[:, plant.input("command")])
    u[:, plant.input("load_setting")] = 40e5
    run = Engine(plant, 1e-6).run(plant.start, t, u)
    assert run.ok
    return plant.observe(run.x, u)[:, [plant.output(name) for name in ("position", "pa", "pb")]]


@pytest.mark.parametrize("cause", OWN, ids=lambda cause: " ".join(cause.key))
def test_what_a_pump_drive_lacks_off_the_library_simulates(cause, rig):
    driven = rig.with_corrector("speed")
    assert applies(cause.effect, rig)
    base = travelled(driven, ())
    moved = np.abs(travelled(driven, (cause.effect,)) - base).max(axis=0) / np.ptp(base, axis=0)
    assert np.max(moved) > 1e-3


def test_pump_drives_have_formulas_and_causes_of_their_own_off_the_library():
    assert {cause.effect.name for cause in OWN} >= {"pump.leakage", "hose.compliance", "plunger that hangs"}


def wrong(name, found=13.4, low=13.3, high=13.5):
    return {"name": name, "described": 16.493, "found": found, "low": low, "high": high}


@pytest.mark.parametrize(
    ("answer", "result"),
    [
        ({"verdict": "none", "numbers": [wrong("AB [cm^2]")]}, "right"),
        ({"verdict": "none", "numbers": []}, "missed"),
        ({"verdict": "none", "numbers": [wrong("AA [cm^2]")]}, "wrong"),
        ({"verdict": "named", "effects": ["hose.compliance"], "numbers": [wrong("AB [cm^2]")]}, "wrong"),
        ({"verdict": "incomplete", "numbers": [wrong("AB [cm^2]")]}, "incomplete"),
    ],
)
def test_a_wrong_number_is_scored_by_its_name(answer, result):
    truth = {"id": "c", "kind": "number", "effects": ["number.AB"], "equations": ["flow"], "rig": "pump-rig"}
    row = judged(truth | {"true": {"AB": 13.4e-4}}, SAID | answer)
    assert row["result"] == result
    assert row["covers"]["effect"] == ([True] if wrong("AB [cm^2]") in answer["numbers"] else [])
    named = next(score for score in scores([row]) if score.id == "number_named")
    assert (named.value, named.n) == (float("AB [cm^2]" in json.dumps(answer)), 1)


def test_a_number_that_is_blamed_for_an_effect_is_a_false_alarm():
    truth = {"id": "c", "kind": "clean", "effects": [], "equations": [], "rig": "pump-rig"}
    row = judged(truth, SAID | {"verdict": "none", "numbers": [wrong("AB [cm^2]")]})
    assert (row["result"], row["verdict"]) == ("wrong", "named")
    rates = {score.id: score.value for score in scores([row])}
    assert (rates["number_blamed"], rates["false_alarms"]) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--rig", "crane"], "--rig crane: campaigns are drawn on jack-10t or pump-rig"),
        (["--kind", "number"], "--kind number: campaigns on jack-10t are single, clean, off, pair"),
        (["--kind", "clean", "--campaigns", "."], "--kind is for campaigns that are drawn"),
        (["--number", "0"], "--number 0"),
        (["--campaigns", "nothere"], "truth.json"),
    ],
)
def test_what_cannot_be_drawn_is_refused(capsys, words, says):
    assert main(words) == 2
    assert says in capsys.readouterr().err
