"""Records of a closed loop that are none, or whose rig has none, are refused with what they seem to be."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from made_inner_loops import PERIOD, campaign, played, press
from scipy.signal import lfilter

from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.frequency.config import load
from workbench.commands.frequency.two_columns import run_pairs
from workbench.identify.data.causality import in_band
from workbench.identify.fit.followed import _off as off
from workbench.records import Record
from workbench.rigs.driven import load_driven
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Rig:
    return press(tmp_path_factory.mktemp("closed"))


def _swapped(s: dict[str, np.ndarray]) -> None:
    s["reference"], s["position"] = s["position"], s["reference"]


def _late(s: dict[str, np.ndarray]) -> None:
    s["reference"] = np.roll(s["reference"], 60)


def _little_late(s: dict[str, np.ndarray]) -> None:
    s["reference"] = np.roll(s["reference"], 8)


def _times(name: str, factor: float) -> Callable[[dict[str, np.ndarray]], None]:
    def change(s: dict[str, np.ndarray]) -> None:
        s[name] = factor * s[name]

    return change


def _off(s: dict[str, np.ndarray]) -> None:
    s["position"][1000:2000] = s["position"][1000]


def _driving(s: dict[str, np.ndarray]) -> None:
    s["force"] = -3e4 * np.gradient(s["position"], PERIOD)


def _strong(s: dict[str, np.ndarray]) -> None:
    s["force"] = -6e5 * np.gradient(s["position"], PERIOD) / np.abs(np.gradient(s["position"], PERIOD)).max()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_strong, r"force reaches 58.* kN, 5[.]8.* times the limit of the rig; check its unit"),
        (_swapped, r"position leads reference by .* ms.*exchange their columns"),
        (_late, r"position leads reference by .* ms.*logged late"),
        (_little_late, r"position leads reference by .* ms.*logged late"),
        (_times("position", 10.0), r"position is (9|10)[.0-9]* times what reference asks for; give both their units"),
        (_times("position", -1.0), r"position goes against reference; give one of them scale = -1"),
        (_times("reference", 1e3), r"reference reaches 3000 mm, and full_command of \[inner\] is 75 mm"),
        (_off, r"position rests from 2 to [34].* s while reference moves: the loop was off"),
        (_driving, r"force drives the jack .*scale = -1 under \[signals\]"),
    ],
)
def test_records_that_are_no_closed_loop_are_refused_in_one_line(rig, tmp_path, capsys, change, words):
    folder = campaign(tmp_path / "c", rig, played(rig), change)
    assert main(["residual", str(folder), "--out", str(tmp_path / "r")]) == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.search(words, line), line
    assert not (tmp_path / "r").exists()


def test_a_rig_without_an_inner_loop_says_what_to_do_with_a_reference_alone(rig, tmp_path):
    folder = campaign(tmp_path / "c", load_rig("jack-10t"), played(rig))
    with pytest.raises(InputError, match=r"no command, the input of rig jack-10t; .*\[inner\].*--ask closed-loop"):
        load_driven(folder)


def test_a_campaign_without_a_command_still_has_a_response(rig, tmp_path):
    folder = campaign(tmp_path / "c", load_rig("jack-10t"), played(rig))
    task = load(folder, ("reference", "position"))
    assert (task.rig, task.pairs[0].units) == (None, ("mm", "mm"))
    answer = run_pairs(task, True, no_checkpoint, lambda _: None)
    gains = [row["gain_db"] for row in answer.metrics["rows"]]
    assert -1.0 < gains[0] < 0.1
    assert gains[-1] < -3.0


def test_a_loop_that_is_too_slow_for_its_reference_is_not_off():

    t = np.arange(0, 10, 1e-3)
    sweep = 2e-3 * np.sin(2 * np.pi * 1.5 * t**2)  # to 30 Hz
    slow = lfilter([0.005], [1, -0.995], sweep) + 1e-5 * np.random.default_rng(0).standard_normal(t.size)
    assert off(Record("slow", t, {"reference": sweep, "position": slow}), "reference", "position") is None
    slow[4000:6000] = slow[4000]
    assert off(Record("off", t, {"reference": sweep, "position": slow}), "reference", "position") == (4.0, 6.0)


def test_lines_that_are_sure_by_chance_beyond_a_slow_sweep_say_nothing_of_who_leads():
    f = 0.5 * np.arange(1, 1001)
    moved, chance = f <= 5, (f > 5) & (np.arange(f.size) % 20 == 0)
    kept = in_band(f, moved | chance)
    assert kept[moved].all()
    assert f[kept].max() < 20  # of 1000 lines to 500 Hz
    assert in_band(f, np.ones(f.size, bool)).all()
    assert not in_band(f, np.zeros(f.size, bool)).any()
