"""Campaign folders: records in their roles, nothing fitted that judges, and every mistake in the file named."""

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.base.toml import read_toml
from workbench.records import load_campaign

SHARED = Path(__file__).parents[2] / "shared"
FESTO = SHARED / "data" / "festo_tp511"
needs_festo = pytest.mark.skipif(not FESTO.is_dir(), reason="no recordings of the Festo rig here")
needs_campaigns = pytest.mark.skipif(not (SHARED / "campaigns").is_dir(), reason="no practice campaigns here")


def a_campaign(folder, text, names=("static", "steps", "multisine")):
    for start, name in enumerate(names, 100):
        lines = ["t [s],command [1],pa [bar]", *(f"{k / 1000:.3f},{0.01 * k:g},{start + k}" for k in range(60))]
        (folder / f"{name}.csv").write_text("\n".join(lines))
    (folder / "campaign.toml").write_text(text)
    return folder


GOOD = """rig = "jack-10t"
[records]
static  = [{file = "static.csv", from = 0.0, to = 0.02}]
train   = ["steps.csv"]
heldout = ["multisine.csv"]
"""


def test_a_campaign_is_its_folder_or_the_file_in_it(tmp_path):
    folder = a_campaign(tmp_path, GOOD)
    for path in (folder, folder / "campaign.toml", str(folder)):
        campaign = load_campaign(path)
        assert (campaign.path, campaign.rig) == (folder, "jack-10t")
        assert [record.name for record in campaign.static] == ["static 0-0.02 s"]
        assert campaign.static[0].t.size == 20
        assert [record.name for record in campaign.train] == ["steps"]
        assert [record.name for record in campaign.heldout] == ["multisine"]


def test_a_rig_file_lies_beside_the_campaign(tmp_path):
    folder = a_campaign(tmp_path, GOOD.replace("jack-10t", "mine.toml"))
    with pytest.raises(InputError, match=r"no such file as mine\.toml"):
        load_campaign(folder)
    (folder / "mine.toml").touch()
    assert load_campaign(folder).rig == str((folder / "mine.toml").resolve())


def test_static_and_train_may_be_absent(tmp_path):
    campaign = load_campaign(a_campaign(tmp_path, 'rig = "r"\n[records]\nheldout = ["multisine.csv"]\n'))
    assert campaign.static == campaign.train == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rig =", "rigg =", 'line 1: rigg: unknown key; did you mean "rig"?'),
        ('"jack-10t"', "3", "rig = 3: write rig"),
        ("heldout =", "holdout =", 'records.holdout: unknown key; did you mean "heldout"?'),
        ('heldout = ["multisine.csv"]', "", "heldout: none; keep one record from the fit"),
        ('["multisine.csv"]', '["steps.csv"]', "steps.csv is also in train"),
        ("heldout =", 'select = ["steps.csv"]\nheldout =', "records.select: steps.csv is also in train; what selects"),
        ("heldout =", 'select = ["multisine.csv"]\nheldout =', "records.heldout: multisine.csv is also in select"),
        ('["steps.csv"]', '["steps.csv", "steps.csv"]', "steps.csv is listed twice"),
        ('["steps.csv"]', '"steps.csv"', "must be a list of files"),
        ('["steps.csv"]', "[1]", "1 is no record"),
        ('["steps.csv"]', '["step.csv"]', "step.csv: no such file"),
        ("from =", "form =", 'form: unknown key; did you mean "from"?'),
        ("to = 0.02", "to = -1", "from 0 to -1 s is empty"),
        ("to = 0.02", 'to = "x"', 'to = "x": must be a finite number'),
        ("[records]", "[records", "campaign.toml: line 2:"),
        ("[records]", '[signals]\npressure = {column = "pa"}\n[records]', "signals.pressure: unknown key"),
        ("[records]", '[signals]\npb = {column = "pc [bar]"}\n[records]', 'no record has a column "pc [bar]"'),
        ("[records]", "[signals]\npa = {clip = [3, 1]}\n[records]", "clip: must be [low, high]"),
        (
            "[records]",
            '[signals]\npa = {units = "bar"}\n[records]',
            "signals.pa.units: unknown key; did",
        ),
        ("[records]", '[signals]\npa = "pa [bar]"\n[records]', "must be a table; write [signals.pa]"),
        ("[records]", "[signals]\npa = {scale = 0}\n[records]", "scale: is 0"),
        ("[records]", "[signals]\npa = {unit = 3}\n[records]", 'unit = 3: write unit = "..."'),
    ],
)
def test_a_bad_campaign_is_refused_in_one_line(tmp_path, old, new, message):
    folder = a_campaign(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_campaign(folder)
    assert message in str(caught.value)
    assert str(folder) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("listed", "message"),
    [
        ('train = ["steps.csv", "again.csv"]', "train: again.csv has the samples of steps.csv in train"),
        ('train = ["steps.csv"]\nheldout = ["packed.csv.gz"]', "heldout: packed.csv.gz has the samples of steps.csv"),
        ('train = ["steps.csv"]\nheldout = ["link.csv"]', "link.csv has the samples of steps.csv in train"),
        ('train = ["steps.csv", "./steps.csv"]', "./steps.csv is listed twice"),
        ('train = [{file = "steps.csv", to = 0.03}, {file = "steps.csv", from = 0.02}]', "steps.csv is listed twice"),
        ('static = ["again.csv"]\ntrain = ["steps.csv"]', "steps.csv has the samples of again.csv in static"),
        ('static = ["steps.csv", "again.csv"]', "again.csv has the samples of steps.csv in static"),
    ],
)
def test_the_same_samples_twice_are_refused(tmp_path, listed, message):
    heldout = "" if "heldout" in listed else 'heldout = ["multisine.csv"]'
    folder = a_campaign(tmp_path, f'rig = "r"\n[records]\n{listed}\n{heldout}\n')
    samples = (folder / "steps.csv").read_bytes()
    (folder / "again.csv").write_bytes(samples)
    (folder / "packed.csv.gz").write_bytes(gzip.compress(samples))
    (folder / "link.csv").symlink_to(folder / "steps.csv")
    with pytest.raises(InputError, match=re.escape(message)):
        load_campaign(folder)


def test_half_a_record_may_be_fitted_and_the_other_half_held_out(tmp_path):
    text = GOOD.replace('["steps.csv"]', '[{file = "steps.csv", to = 0.03}]')
    campaign = load_campaign(
        a_campaign(tmp_path, text.replace('["multisine.csv"]', '[{file = "steps.csv", from = 0.03}]'))
    )
    assert campaign.train[0].t[-1] < campaign.heldout[0].t[0]
    assert campaign.heldout[0].name == "steps 0.03-end"


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"a = 1\nb =", "line 2: "), (b"a = '\xff'", "line 1: not UTF-8"), (b"a = [1,", "line 1: ")],
)
def test_bad_toml_is_refused_by_line(tmp_path, content, message):
    (tmp_path / "a.toml").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_toml(tmp_path / "a.toml")
    with pytest.raises(InputError, match="no such file"):
        read_toml(tmp_path / "b.toml")
    with pytest.raises(InputError, match="is a folder"):
        read_toml(tmp_path)


@needs_campaigns
@pytest.mark.parametrize("name", ["p01", "p02", "p03", "p04", "p05", "p06"])
def test_a_clean_practice_campaign_needs_no_mending(name):
    campaign = load_campaign(SHARED / "campaigns" / name)
    for record in (*campaign.static, *campaign.train, *campaign.heldout):
        assert record.notes == ()
        assert all(mask.all() for mask in record.valid.values())


@needs_campaigns
def test_the_blemishes_of_p07_are_found_where_they_are():
    campaign = load_campaign(SHARED / "campaigns" / "p07")
    steps, _ = campaign.train
    assert steps.notes == (
        "steps.csv.gz: 1 sample dropped before row 1546; the command is held there",
        'steps.csv.gz: column "current [mA]", rows 1075, 2183: empty, not compared',
        'steps.csv.gz: column "spool [um]", rows 3008, 4204: empty, not compared',
        'steps.csv.gz: column "position [m]", row 827: empty, not compared',
    )
    multisine = campaign.heldout[0]
    assert sum(int((~mask).sum()) for mask in multisine.valid.values()) == 5
    assert np.ptp(multisine.signals["position"]) < 0.5  # the stroke, in m
    assert 50e5 < multisine.signals["pa"].mean() < 160e5


@needs_festo
def test_the_festo_campaign_marks_its_end_stop():
    campaign = load_campaign(FESTO)
    assert [record.t.size for record in campaign.static] == [100, 100]
    for record in campaign.train:
        assert np.max(np.abs(record.signals["command"])) in (pytest.approx(0.1), pytest.approx(0.5))
        assert np.all(record.signals["position"][record.valid["position"]] < 0.1995)
        assert 0.2 < np.mean(~record.valid["position"]) < 0.5
