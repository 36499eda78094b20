"""Modal laws that follow the modes of another platform: couplings, numbers, files."""

import json

import numpy as np
import pytest

from workbench.cli import main
from workbench.commands.common.experiment_file import read_experiment
from workbench.commands.common.shipped import experiment
from workbench.commands.retune.platform import followed
from workbench.rigs.platform import load_platform
from workbench.rigs.platform.platform_file import platform_text

SHIPPED = experiment("hexapod")


def high(folder):
    """A platform file whose payload has its centre 1 m up."""
    path = folder / "high.toml"
    path.write_text(platform_text(load_platform("hexapod").with_values(cz=1.0), ["jack-10t"] * 6))
    return path


def brief(folder, controllers=("p-dp", "modal")):
    """The shipped experiment with one step and these controllers."""
    text = SHIPPED.read_text()
    text = text.replace(text[text.index("scenarios") : text.index("# p-dp as")], 'scenarios = ["surge-10mm"]\n')
    if "modal" not in controllers:
        text = text[: text.index("# A law on each mode")] + text[text.index("[transfer]") :]
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_laws_of_the_same_modes_stay_and_others_go_with_theirs():
    table = read_experiment(SHIPPED).values["controllers"]["modal"]
    assert followed(table, np.ones(6)) == table
    faster = followed(table, np.array([1.0, 1.0, 2.0, 1.0, 1.0, 1.0]))
    first, second, *_ = faster["laws"]
    assert first == table["laws"][0]
    assert second["forward"]["frequency"] == "44.8 Hz"
    assert second["compensators"][0]["gain"]["value"] == pytest.approx(2 * 0.0002989)
    assert second["gain"] == table["laws"][1]["gain"]


def test_on_a_payload_whose_centre_is_a_metre_up_retuned_laws_decouple_again(tmp_path):
    out = tmp_path / "out"
    assert main(["retune", str(brief(tmp_path)), "--found", str(high(tmp_path)), "--out", str(out)]) == 0
    metrics = json.loads((out / "metrics.json").read_text())
    old, new = metrics["linear"]
    assert (old["way"], new["way"]) == ("old", "retuned")
    assert old["coupling_percent"] > 3
    assert new["coupling_percent"] < 0.5  # 3 % were asked for
    assert new["ms"] < 2.1
    assert metrics["left_out"] == ["p-dp"]
    steps = {row["way"]: row for row in metrics["rows"]}
    assert steps["retuned"]["settling_s"] <= steps["old"]["settling_s"]
    assert max(steps["retuned"]["cross"].values()) < max(steps["old"]["cross"].values())
    found = read_experiment(out / "retuned.toml")
    assert load_platform(found.text("rig"), out)["cz"] == 1.0
    again = tmp_path / "again"
    assert main(["retune", str(out / "retuned.toml"), "--found", str(out / "platform.toml"), "--out", str(again)]) == 0
    unchanged = json.loads((again / "metrics.json").read_text())
    assert [each["times_as_fast"] for each in unchanged["modes"]] == pytest.approx([1.0] * 6)
    assert unchanged["linear"][0]["coupling_percent"] == pytest.approx(new["coupling_percent"])


@pytest.mark.parametrize(
    ("controllers", "more", "message"),
    [
        (("p-dp",), [], "none has laws on modes"),
        (("p-dp", "modal"), ["--designs", "5"], "--designs belongs to a search on one jack"),
    ],
)
def test_what_cannot_follow_is_one_line(controllers, more, message, tmp_path, capsys):
    words = ["retune", str(brief(tmp_path, controllers)), "--found", "hexapod", "--out", str(tmp_path / "out"), *more]
    with pytest.raises(SystemExit) as stopped:
        raise SystemExit(main(words))
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
