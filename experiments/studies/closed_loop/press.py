"""The figures of docs/results/press.md, by the commands that the page names, from recordings that the project has not.

Two sweeps of a press, chirp0A.csv.gz and chirp1A.csv.gz (see the page), are fitted and held out in turn. The
trace, which takes as long again as all the others, is left out.
"""

import gzip
import json
from collections.abc import Mapping
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from workbench.base.errors import InputError
from workbench.cli import main as jackbench
from workbench.commands.common.outcome import Outcome, Progress, Stage
from workbench.commands.new.closed_loop import closed_loop_files
from workbench.report import Curve, Figure, Page, Panel, Section, Table

Metrics = Mapping[str, Any]
_SWEEPS = ("chirp0A", "chirp1A")  # fitted, held out
_LABEL = {"force": 1e5, "stroke": 0.15, "speed": 0.5, "M": 100.0}
_REST = '{file = "chirp1A.csv", from = 0.5, to = 4.0}'  # before its sweep
_EFFECTS = """
[[effects]]
name = "main.asymmetry"
formula = "direction"
a = {value = 0.0, unit = "1", bounds = [-0.6, 0.6]}

[[effects]]
name = "main.deadband"
formula = "lap"
overlap = {value = 0.005, unit = "1", bounds = [0.0, 0.6]}
"""
_ASKED = ("inverse inverse.toml", "learn learn.toml", "sines sines.toml", "inverse hybrid.toml", "bench specimen.toml")


def run_press(recordings: Path, _stage: Stage, progress: Progress) -> Outcome:
    """`rows`: of each command of the page its figures, in the units of the page. Raises InputError without the
    recordings."""
    with TemporaryDirectory() as scratch:
        commands = _Commands(Path(scratch), progress)
        _make(recordings, Path(scratch))
        two = " ".join(f"{name}.csv" for name in _SWEEPS)
        rows = [
            _response(commands(f"frequency {two} --input reference --output position --model")),
            {"floor": commands("residual rest")["rows"][0]["floor"]},
            _fit(commands("fit campaign --starts 3")),
            _fit(commands("fit effects --starts 3")),
            _fit(commands("fit exchanged --starts 3")),
            *(_asked(commands(f"{each} --rig out-2/rig.toml")) for each in _ASKED),
        ]
        rows = [{"command": line, **row} for line, row in zip(commands.lines, rows, strict=True)]
    return Outcome({"rows": rows}, lambda: _page(rows))


@dataclass
class _Commands:
    """Commands in a folder, which leave out-0, out-1 ... there; `lines` are what they were."""

    folder: Path
    progress: Progress
    lines: list[str] = field(default_factory=list)

    def __call__(self, line: str) -> Metrics:
        self.progress(line)
        out, said = f"out-{len(self.lines)}", StringIO()
        self.lines.append(line)
        with chdir(self.folder), redirect_stdout(said), redirect_stderr(said):
            status = jackbench([*line.split(), "--out", out])
        if status:
            raise InputError(f"{line}: {said.getvalue().splitlines()[-1]}")
        return json.loads((self.folder / out / "metrics.json").read_text(encoding="utf-8"))


def _make(recordings: Path, folder: Path) -> None:
    """The sweeps, the starter folder of the label, and four campaigns."""
    for name in _SWEEPS:
        if not (packed := recordings / f"{name}.csv.gz").exists():
            raise InputError(f"{packed}: no such file; give the folder of the recordings of the press")
        (folder / f"{name}.csv").write_bytes(gzip.decompress(packed.read_bytes()))
    files = closed_loop_files(_LABEL, "press")
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "effects.toml").write_text(files["rig.toml"] + _EFFECTS, encoding="utf-8")
    made = {"campaign": "rig", "rest": "rig", "effects": "effects", "exchanged": "rig"}
    for name, rig in made.items():
        train, heldout = _SWEEPS[::-1] if name == "exchanged" else _SWEEPS
        static = f"static = [{_REST}]\n" if name == "rest" else ""
        own = folder / name
        own.mkdir()
        for sweep in _SWEEPS:
            (own / f"{sweep}.csv").hardlink_to(folder / f"{sweep}.csv")
        lists = f'{static}train = ["{train}.csv"]\nheldout = ["{heldout}.csv"]\n'
        (own / "campaign.toml").write_text(f'rig = "../{rig}.toml"\n[records]\n{lists}', encoding="utf-8")


def _response(of: Metrics) -> Metrics:
    poles = np.roots(of["model"]["denominator"])
    return {"delay_ms": 1e3 * of["delay_s"], "poles": poles.real.tolist(), "model": of["model"]}


def _fit(of: Metrics) -> Metrics:
    """Of the held-out windows, mm: what the label, the fit and each servo leave; numbers with their intervals."""
    rms = of["rms"]["position [mm]"]
    rungs = {rung["rung"]: rung["left"] for rung in of["ladder"]["rungs"]}
    numbers = {name: value for rung in of["ladder"]["rungs"][:1] for name, value in rung["numbers"].items()}
    kept = ("unseen", "at_an_end", "growing_pole", "parameters", "shares", "remains")
    return {"before": rms["before"], "after": rms["after"], "floor": rms["floor"], "rungs": rungs, "servo": numbers,
            "bears": of["ladder"]["bears"], **{key: of[key] for key in kept}}  # fmt: skip


def _asked(of: Metrics) -> Metrics:
    """What an experiment on the fitted rig gives: the first that it has of these."""
    rows = of["rows"]
    if "learned" in of:
        return {"fall_db": of["learned"][0]["fall_db"], "repetitions": rows[-1]["iteration"]}
    if "settling_s" in rows[0]:
        return {"settling_ms": {row["rig"]: 1e3 * row["settling_s"] for row in rows}}
    if "way" in rows[0]:
        return {way: [row["frequency"] for row in rows if row["way"] == way and row["within"]]
                for way in dict.fromkeys(row["way"] for row in rows)}  # fmt: skip
    return {"factor": rows[0]["factor"], "outer": {how: _worse(of["outer"], how) for how in ("as it is", "inverse")}
            if of["outer"] else None}  # fmt: skip


def _worse(rows: list[Metrics], how: str) -> Metrics:
    own = [row for row in rows if row["reference"] == how]
    return {"gain_margin_db": min(row["gain_margin_db"] for row in own), "ms": max(row["ms"] for row in own)}


def _page(rows: list[dict[str, Any]]) -> tuple[Page, Figure]:
    fits = [row for row in rows if "after" in row]
    left = Curve("left", np.arange(1.0, len(fits) + 1), np.array([row["after"] for row in fits]), "markers")
    figure = Figure("What is left of the held-out sweep", "command", [Panel("position [mm]", [left])],
                    x_names=[row["command"] for row in fits])  # fmt: skip
    lines = [
        [row["command"], json.dumps({key: value for key, value in row.items() if key != "command"})] for row in rows
    ]
    said = f"{len(rows)} commands on the recordings of the press."
    return Page("The press", said, [Section("Figures", [Table("", ["command", "figures"], lines), figure])]), figure
