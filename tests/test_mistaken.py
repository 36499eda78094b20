"""Recordings and rigs that cannot be what they are called are named as what they are, before anything is fitted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_campaigns import LIBRARY, rubbing, rubbing_campaign
from scipy.signal import lfilter

from experiments.studies.trace.campaigns.draw import CampaignPlan, drawn_scene
from experiments.studies.watch.made_rig import MadeRig, write_sessions
from workbench.base.errors import InputError
from workbench.base.recent import Recent
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.fit.study import fit_campaign
from workbench.commands.residual.study import run_residual
from workbench.commands.trace.study import run_trace, trace_campaign
from workbench.identify.data.scored_floor import scored_floor
from workbench.identify.data.static import check_static
from workbench.identify.fit import checked_columns, mistaken
from workbench.identify.fit.checked_columns import MistakenColumns, check_columns
from workbench.identify.fit.late import Lags
from workbench.identify.fit.rehearsal import Rehearsal, Tried
from workbench.identify.fit.unfelt import unfelt_force
from workbench.identify.trace import estimation_problem
from workbench.plant import build
from workbench.plant.effects.declared import effects_for
from workbench.plant.effects.logger import LOGGER_SHIFT
from workbench.records import load_campaign
from workbench.rigs.driven import SHIFT, driven
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

BUNDLED = Path(__file__).parents[1] / "workbench" / "rigs" / "jack-10t.toml"
SAMPLE = Path(__file__).parents[1] / "experiments" / "sample"


@pytest.fixture(scope="module")
def sample():
    return load_campaign(SAMPLE)


def changed(campaign, change):
    """The campaign with other signals in every record."""

    def each(records):
        return tuple(replace(record, signals={**record.signals, **change(record.signals)}) for record in records)

    roles = {role: each(getattr(campaign, role)) for role in ("static", "train", "select", "heldout")}
    return replace(campaign, **roles)


def test_columns_that_are_what_they_are_called_pass(sample, rig):
    check_columns(sample, rig, scored_floor(sample, rig))


def test_what_was_found_of_the_same_records_of_the_same_rig_is_not_sought_again(sample, rig, monkeypatch):
    """A refusal is said again; any other sample, role, lateness, number of the rig or noise is looked at anew."""
    sought, wrong = [], mistaken.turned("spool")
    monkeypatch.setattr(checked_columns, "_FOUND", Recent(1000.0, lambda _: 1.0))
    monkeypatch.setattr(checked_columns, "mistaken", lambda *asked: sought.append(asked) or wrong)
    floor, (first, *rest) = scored_floor(sample, rig), sample.train
    bent = replace(first, signals={**first.signals, "pa": np.append(first.signals["pa"][:-1], 1e7)})
    renamed = replace(first, signals={("pc" if name == "pb" else name): each for name, each in first.signals.items()})
    others = [(replace(sample, train=(each, *rest)), rig, floor) for each in (bent, renamed, replace(first, late=1e-4))]
    others += [
        (replace(sample, select=(first,), train=tuple(rest)), rig, floor),
        (sample, rig.with_values(M=rig["M"] + 1), floor),
        (sample, rig, replace(floor, sigma={**floor.sigma, "pa": 1.0})),
    ]
    for count, asked in enumerate([(sample, rig, floor), *others], 1):
        for _ in range(2):
            with pytest.raises(MistakenColumns, match="the sign of spool looks wrong"):
                check_columns(*asked)
        assert len(sought) == count


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda s: {"pa": s["pb"], "pb": s["pa"]},
            "pa and pb look swapped: chi2 of jack-10t, fitted to a few windows, .* exchange the two",
        ),
        (lambda s: {"command": -s["command"]}, "the sign of command looks wrong"),
        (lambda s: {"position": -s["position"]}, "the sign of position looks wrong"),
        (lambda s: {"spool": -s["spool"]}, "the sign of spool looks wrong"),
        (lambda s: {"command": 10 * s["command"]}, "command reaches 4.2.*, and 1 is full command"),
        (lambda s: {"pa": 1e5 * s["pa"]}, "pa reaches .* bar, and the supply has 210 bar; it looks like Pa under bar"),
        (lambda s: {"pb": s["pb"] / 10}, "pb looks 10 times too small"),
    ],
)
def test_a_column_that_is_mistaken_is_named(sample, rig, change, words):
    wrong = changed(sample, change)
    with pytest.raises(InputError, match=words):
        check_columns(wrong, rig, scored_floor(wrong, rig))


def with_force(campaign, of):
    """The campaign with a noisy force column [N] in every record."""

    def each(record):
        force = of(record.signals) + 20.0 * np.random.default_rng(len(record.t)).standard_normal(record.t.size)
        valid = {**record.valid, "force": np.ones(record.t.size, bool)}
        return replace(record, signals={**record.signals, "force": force}, valid=valid)

    roles = {role: tuple(map(each, getattr(campaign, role))) for role in ("static", "train", "select", "heldout")}
    return replace(campaign, **roles)


def test_a_force_that_nothing_on_the_rig_makes_is_refused_with_what_may_make_it(sample, rig):
    """Without a specimen the model's force is 0 whatever is fitted; a cell on the rod feels what moves the mass."""
    pushed = with_force(sample, lambda s: rig["M"] * s["acceleration"])
    refused = r'force goes over .* kN, and jack-10t has nothing that a load cell feels.*kind = "rod-cell".*unused'
    with pytest.raises(InputError, match=refused):
        estimation_problem(pushed, rig)
    for silent in (with_force(sample, lambda s: 0 * s["position"]), with_force(sample, lambda s: 1e5 * s["position"])):
        assert unfelt_force(silent, rig, scored_floor(silent, rig)) is None  # noise; a spring that a trace may name
    rod = replace(rig, load="rod-cell", numbers={**rig.numbers, "Mr": Number("Mr", 0.0, "kg", "kg", "")})
    for able in (rod, rig.with_values(ks=1e5)):
        assert unfelt_force(pushed, able, scored_floor(pushed, able)) is None
    check_columns(pushed, rod, scored_floor(pushed, rod))


@pytest.mark.parametrize(("turned", "wrong"), [({"position": 0.95}, True), ({"position": 0.7}, False), ({}, False)])
def test_a_turned_command_has_to_make_the_jack_follow_however_near_one_at_rest_is(
    monkeypatch, sample, rig, turned, wrong
):
    """A pump whose command is turned stands still, which beats a model that is far off in its phase."""
    likeness = iter([({"position": 0.8}, {"position": 1.0}), (turned, {}), (turned, {})])
    chi2 = iter([700.0, 100.0])
    still = Lags(("position",), np.array([-1e-3, 0.0, 1e-3]), np.array([[0.7], [0.8], [0.7]]))
    monkeypatch.setattr(mistaken, "_likeness", lambda *_: next(likeness))
    monkeypatch.setattr(mistaken, "lags_of", lambda *_: still)
    monkeypatch.setattr(Rehearsal, "fit", lambda *_: Tried(next(chi2), np.zeros(0), np.zeros(0)))
    found = mistaken.mistaken(sample, rig, scored_floor(sample, rig))
    assert (found is not None and found.words == "the sign of command looks wrong") == wrong


def late(shifts, swap=False):
    """A record of which signals are late [s]; the pressures may have changed places too."""

    def change(record):
        moved = record.earlier({name: -shift for name, shift in shifts.items()})
        swapped = {"pa": moved.signals["pb"], "pb": moved.signals["pa"]} if swap else {}
        return replace(moved, signals={**moved.signals, **swapped})

    return change


def made_late(campaign, change):
    return replace(campaign, **{role: tuple(map(change, getattr(campaign, role))) for role in ("train", "heldout")})


def test_what_another_logger_records_earlier_is_named_as_early(sample, rig):
    wrong = made_late(sample, late({"position": -4e-3}))
    with pytest.raises(InputError, match=r"position looks 4 ms early.*; shift"):
        check_columns(wrong, rig, scored_floor(wrong, rig))


def test_a_trace_puts_back_what_a_second_logger_recorded_and_names_the_shift():
    wrong = made_late(rubbing_campaign(), late({"position": 8e-3, "spool": 8e-3}))
    found = run_trace(wrong, rubbing(), LIBRARY[1:], no_checkpoint, lambda _: None)
    answer, (row, *_) = found.metrics, found.metrics["ranking"]
    assert (answer["verdict"], answer["equation"], answer["effects"]) == ("named", "sensor", ["sensor.shift"])
    assert (row["effect"], row["formula"]) == ("sensor.shift", "spool and position")
    value, low, high = row["parameters"]["late [ms]"]
    assert low < 8.0 < high
    assert high - low < 0.4
    assert answer["chi2"]["after"] < 1.1 < 10 < answer["chi2"]["before"]
    assert f"recorded spool and position {value:.4g} ms late" in found.page.verdict


BENCH = Path(__file__).parents[2] / "shared" / "bench"


@pytest.mark.skipif(not BENCH.exists(), reason="the benches lie outside the project")
@pytest.mark.parametrize("name", ["clean", "gap", "rate", "hystns", "aa", "late"])
def test_only_the_second_logger_of_the_benches_is_diagnosed(name):
    """A clearance, a rate limit, hysteresis and a filter are no mistaken columns; half a swing late is no exchange."""
    campaign = load_campaign(BENCH / name)
    rig = load_rig(campaign.rig)
    found = mistaken.mistaken(campaign, rig, scored_floor(campaign, rig))
    if name != "late":
        assert found is None
        return
    assert found is not None
    assert "pa, pb and acceleration look 7 ms late" in found.told(rig.name)
    assert "exchange" not in found.remedy
    assert (found.chi2 or (np.inf, np.inf))[1] < 1.4  # its oil bears 2.9 bar of tension in six rows, ours none


@pytest.mark.skipif(not BENCH.exists(), reason="the benches lie outside the project")
@pytest.mark.parametrize(
    ("rows", "signals", "words"),
    [
        (1, ("pa", "pb", "acceleration"), "pa, pb and acceleration look 1 ms late"),
        (-1, ("position",), "position looks 1 ms early"),
        (1, ("spool", "pa", "pb", "position", "acceleration"), None),
    ],
)
def test_a_row_between_two_loggers_is_seen_about_the_fit_and_one_that_all_share_is_the_drive_s(rows, signals, words):
    campaign = load_campaign(BENCH / "clean")
    rig = load_rig(campaign.rig)
    wrong = made_late(campaign, late(dict.fromkeys(signals, 1e-3 * rows)))
    found = mistaken.mistaken(wrong, rig, scored_floor(wrong, rig))
    if words is None:
        assert found is None
        return
    assert found is not None
    assert words in found.words
    assert set(found.late) == set(signals)
    assert (found.chi2 or (np.inf, np.inf))[1] < 1.5


@pytest.mark.skipif(not BENCH.exists(), reason="the benches lie outside the project")
def test_a_second_logger_with_two_pressures_exchanged_is_named_as_both():
    """Half a swing late and exchanged, they move nearly as predicted."""
    campaign = load_campaign(BENCH / "clean")
    rig = load_rig(campaign.rig)
    wrong = made_late(campaign, late(dict.fromkeys(("pa", "pb", "acceleration"), 7e-3), swap=True))
    with pytest.raises(InputError, match=r"look 7 ms late.* and pa and pb look swapped.*; shift .*; exchange the two"):
        check_columns(wrong, rig, scored_floor(wrong, rig))


def test_what_nothing_cures_is_no_order(sample, rig):
    """Pressures that move against their predictions and as much with a hum that nothing explains."""

    def change(s):
        hum = np.sin(2 * np.pi * 7.0 * 1e-3 * np.arange(len(s["pa"])))
        about = {name: (np.mean(s[name]), s[name] - np.mean(s[name])) for name in ("pa", "pb")}
        return {name: mean - 0.5 * moves + 0.8 * np.std(moves) * hum for name, (mean, moves) in about.items()}

    wrong = changed(sample, change)
    with pytest.raises(InputError, match="none of which cures it") as told:
        check_columns(wrong, rig, scored_floor(wrong, rig))
    assert "exchange the two columns" not in str(told.value)


def test_a_jack_that_a_starved_pump_slows_has_no_wrong_unit(sample, rig):
    """Its position moves a tenth as far, but a factor of ten leaves a fifth of the misfit: the rig lacks something."""

    def starved(s):
        steps = np.diff(s["position"], prepend=s["position"][0])
        most = 0.06 * np.quantile(np.abs(steps), 0.99)
        return {"position": s["position"][0] + np.cumsum(np.clip(steps, -most, most))}

    wrong = changed(sample, starved)
    assert mistaken.mistaken(wrong, rig, scored_floor(wrong, rig)) is None


def test_a_pressure_line_is_no_second_logger(sample, rig):
    """What an effect explains is traced, not refused: transducers that lag behind their lines."""

    def lagging(s):
        return {name: lfilter([0.5], [1, -0.5], s[name] - s[name][0]) + s[name][0] for name in ("pa", "pb")}

    wrong = changed(sample, lagging)
    assert mistaken.mistaken(wrong, rig, scored_floor(wrong, rig)) is None


def test_a_static_record_that_moves_is_refused(sample):
    check_static(sample)
    with pytest.raises(InputError, match=r"static record triangle moves: position varies by 24 mm .* list one at rest"):
        check_static(replace(sample, static=(sample.train[1],)))


def test_a_copy_in_another_format_is_a_copy(tmp_path):
    """A held-out record that is a train record with its last digits cut is the train record."""
    for path in SAMPLE.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    text = (SAMPLE / "campaign.toml").read_text("utf-8")
    (tmp_path / "campaign.toml").write_text(text.replace("multisine.csv.gz", "again.csv"), "utf-8")
    record = load_campaign(SAMPLE).train[0]
    units = {"command": (1.0, "1"), "position": (1e3, "mm"), "pa": (1e-5, "bar")}
    columns = [record.t, *(record.signals[name] * scale for name, (scale, _) in units.items())]
    header = ",".join(["t [s]", *(f"{name} [{unit}]" for name, (_, unit) in units.items())])
    np.savetxt(tmp_path / "again.csv", np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.17g")
    with pytest.raises(InputError, match=r"again.csv has the samples of steps.csv.gz in train; list them once"):
        load_campaign(tmp_path)


def test_a_clip_that_leaves_nothing_is_refused(tmp_path):
    for path in SAMPLE.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    with (tmp_path / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write('\n[signals.pa]\ncolumn = "pa"\nclip = [-2.0, -1.0]\n')
    with pytest.raises(InputError, match=r"pa .*: clip leaves no sample, they go from .* to .*; widen it"):
        load_campaign(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Ps = {value = 210", "Ps = {value = 3", r"supply.Ps: 3 bar is not above the return pressure, 4.35\d* bar"),
        ("stroke = {value = 0.24", "stroke = {value = 0.3", r"limits.stroke: 300 mm .* beyond the end stops, 250 mm"),
    ],
)
def test_numbers_that_cannot_be_beside_each_other_are_refused(tmp_path, old, new, words):
    path, text = tmp_path / "rig.toml", BUNDLED.read_text("utf-8")
    assert old in text
    text = text.replace(old, new).replace("bounds = [203.7, 216.3]", "bounds = [1, 216.3]")
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match=words):
        load_rig(path)


def test_a_healthy_session_whose_first_fit_is_caught_on_its_way_is_not_called_late(tmp_path):
    """Fitted from the declared numbers its windows leave chi2 of 1,690, and 10 with three channels 0.3 ms early; from
    where that fit ends, the windows as they are leave as little."""
    healthy = MadeRig(7207, None, sessions=1, noise="coloured")
    write_sessions(healthy, drawn_scene(CampaignPlan(7207, "single", noise="coloured", sharp=0.5)), tmp_path)
    (session,) = tmp_path.iterdir()
    campaign = load_campaign(session)
    check_columns(campaign, load_rig(campaign.rig), scored_floor(campaign, load_rig(campaign.rig)))


def shifting(**late):
    """The rubbing cylinder whose file declares channels as late [ms]."""
    numbers = {name: Number(name, each, "ms", "ms", "made up") for name, each in late.items()}
    rig = rubbing()
    return replace(rig, effects=(*rig.effects, EffectUse(SHIFT, "", numbers)))


def test_what_a_rig_declares_as_late_or_early_is_put_back_before_anything_is_compared(tmp_path):
    """In residual, fit and trace, from its file; and the trace names no shift any more."""
    wrong = made_late(rubbing_campaign(), late({"position": 8e-3, "spool": -6e-3}))
    save_rig(shifting(position=8.0, spool=-6.0), tmp_path / "rig.toml")
    declared = load_rig(tmp_path / "rig.toml")
    back, as_it_was = driven(wrong, declared), rubbing_campaign()
    chi2 = run_residual(as_it_was, rubbing(), no_checkpoint, lambda _: None).metrics["chi2"]
    assert run_residual(back, declared, no_checkpoint, lambda _: None).metrics["chi2"] == pytest.approx(chi2, rel=0.1)
    with pytest.raises(InputError, match="late"):
        run_residual(driven(wrong, rubbing()), rubbing(), no_checkpoint, lambda _: None)
    assert fit_campaign(back, declared, 1, no_checkpoint, lambda _: None).outcome.metrics["chi2"]["heldout"] < 1.1
    answer = trace_campaign(wrong, declared).outcome.metrics
    assert (answer["verdict"], answer["effects"]) == ("none", [])


def driven_by(rig):
    """The rig, once the campaign's records are those that it drives."""
    driven(rubbing_campaign(), rig)
    return rig


def test_a_shift_that_no_logger_has_is_refused():
    rig = shifting(position=8.0)
    for name, number, said in (
        ("position", {"low": 0.0, "high": 10.0}, "leave out its bounds"),
        ("valve", {}, 'no number "valve"'),
        ("position", {"value": 2000.0}, "2 s is outside -1 to 1 s; check its unit"),
        ("position", {"unit": "mm", "si": "mm"}, "sensor.shift: position: unit"),
    ):
        use = EffectUse(SHIFT, "", {name: replace(rig.effects[-1].numbers["position"], **number)})
        other = replace(rig, effects=(use,))
        with pytest.raises(InputError, match=said):
            build(driven_by(other))
    assert LOGGER_SHIFT not in effects_for(rig)
