"""Recordings of a platform in simulation: multisines on six axes, and a campaign whose columns are legs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...control.platform_controller import LEGS, PlatformSpec
from ...loop.platform import PlatformRun, PlatformSetup, platform_setup
from ...loop.platform.excitation import AxesMultisine, checked_run, drive_spec, largest_run, six_sines, still
from ...loop.sensors import logged
from ...records.frequency_sheet import table_text
from ...report import Figure, Page, Section, Table
from ...rigs.platform import AXES, Platform, bundled_platforms, load_platform
from ...rigs.platform.platform_file import platform_path
from ..common.outcome import Outcome, Progress, Stage
from ..common.platform_motion import PlatformMotion, file_motion
from ..common.platform_scene import pose_panels
from ..common.time_figure import signal_panel
from .study import REST, STATIC, campaign_text, records_page, role_of

MOTIONS = (
    AxesMultisine("fast", 5.0, (0.4, 10.0), 1),
    AxesMultisine("slow", 6.0, (0.25, 3.0), 2),
    AxesMultisine("mixed", 4.0, (0.25, 6.0), 3),
)
"""The last one is held out."""


@dataclass(frozen=True)
class PlatformPlan:
    """What is to be recorded: the platform as it is simulated, what the campaign says of it, and motions to play
    instead of MOTIONS, by name."""

    platform: Platform
    file: Path
    bundled: bool
    seed: int
    played: Mapping[str, PlatformMotion] = field(default_factory=dict)

    @property
    def declared(self) -> str:
        """What campaign.toml names."""
        return self.platform.name if self.bundled else str(self.file.resolve())


def platform_plan(name: str, seed: int, files: Sequence[Path] = ()) -> PlatformPlan:
    """Read a platform, and files with motions. Raises InputError for legs that do not say where they are."""
    platform, bundled = load_platform(name), name in bundled_platforms()
    if seed < 0:
        raise InputError(f"seed {seed}: must be 0 or more")
    if any("position" not in leg.rig.sensors for leg in platform.legs):
        raise InputError(f"platform {name}: a leg without a position sensor, which its drive needs; add it to its rig")
    names = [path.stem for path in files]
    if twice := [each for each in names if names.count(each) > 1 or each == STATIC]:
        raise InputError(
            f"--play {twice[0]}.csv: each record needs a name of its own, {STATIC} is taken; rename the file"
        )
    played = {path.stem: file_motion(path, platform) for path in files}
    return PlatformPlan(platform, platform_path(name) if bundled else Path(name), bundled, seed, played)


def identity(plan: PlatformPlan) -> dict[str, Any]:
    """What says that a recording is the same one."""
    play = {name: sha256(motion.pose.tobytes()).hexdigest()[:16] for name, motion in plan.played.items()}
    return {"command": "record", "rig": plan.platform.table(), "seed": plan.seed, "play": play}


def run_platform_record(plan: PlatformPlan, stage: Stage, progress: Progress) -> Outcome:
    """Play and log every motion; the last one is held out, `static` measures the noise, the others are train."""
    progress("platform and its drive")
    setup = platform_setup(plan.platform)
    spec = drive_spec(setup)
    runs = {STATIC: still(setup, spec, REST, plan.seed)} | _runs(plan, setup, spec, progress)
    records = {name: _columns(setup, run, (plan.seed, number)) for number, (name, run) in enumerate(runs.items())}
    rows = [_row(name, role_of(name, list(runs)), run) for name, run in runs.items()]
    metrics = {"rows": rows, "seed": plan.seed, "loop_gains": [law.design.gain for law in spec.laws]}
    files = {"campaign.toml": campaign_text(plan.declared, plan.seed, rows, (STATIC, "train", "heldout"))}
    files |= {f"{name}.csv": table_text(each) for name, each in records.items()}

    def draw() -> tuple[Page, Figure]:
        figures = [_figure(name, run) for name, run in runs.items()]
        return _page(plan, rows, figures), figures[-1]

    return Outcome(metrics, draw, files=files)


def _runs(plan: PlatformPlan, setup: PlatformSetup, spec: PlatformSpec, progress: Progress) -> dict[str, PlatformRun]:
    """The motions of files as they are, else MOTIONS as large as the platform takes them."""
    runs = {}
    for name, motion in plan.played.items():
        progress(f"{name}: {len(motion.pose) * setup.platform.period:.3g} s")
        try:
            runs[name] = checked_run(setup, spec, motion.pose, plan.seed)
        except InputError as error:
            raise InputError(f"--play {name}: {error}") from None
    for motion in () if plan.played else MOTIONS:
        progress(f"{motion.name}: {motion.seconds:g} s")
        taken = largest_run(setup, spec, six_sines(setup, motion), plan.seed)
        if taken is None:
            raise InputError(f"platform {setup.platform.name}: cannot play {motion.name} at any size; check its limits")
        runs[motion.name] = taken[1]
    return runs


def _columns(setup: PlatformSetup, run: PlatformRun, seed: tuple[int, int]) -> dict[str, np.ndarray]:
    """What is logged, by column, SI: leg by leg the command and what its sensors say."""
    columns = {"t": run.t}
    for i, leg in enumerate(setup.platform.legs):
        outputs = tuple(name[5:] for name in run.signals if name.startswith(f"leg{i + 1}."))
        true = {name: run.signals[f"leg{i + 1}.{name}"] for name in outputs}
        own = logged(true, leg.rig, outputs, seed[0] + 1, LEGS * seed[1] + i)
        columns |= {f"leg{i + 1}.{name}": values for name, values in {"command": run.sent[:, i], **own}.items()}
    return columns


def _row(name: str, role: str, run: PlatformRun) -> dict[str, Any]:
    return {
        "record": name,
        "role": role,
        "seconds": float(run.t[-1]),
        "peak_force_kn": float(np.abs(run.legs("force")).max() / 1e3),
        "peak_speed_m_s": float(np.abs(run.legs("velocity")).max()),
        "peak_command": float(np.abs(run.sent).max()),
        "lowest_pressure_bar": float(run.signals["lowest_pressure"].min() / 1e5),
    }


def _page(plan: PlatformPlan, rows: list[dict[str, Any]], figures: list[Figure]) -> Page:
    heads = ["record", "role", "duration [s]", "force [kN]", "speed [m/s]", "command [1]", "lowest [bar]"]
    note = "Largest of all legs."
    if not plan.played:
        note += " Each axis has harmonics of its own, so that an answer tells which axis was moved."
    table = Table("What was recorded", heads, [list(row.values()) for row in rows], note)
    how = "Row k is what the sensors of the legs say at t_k right after the commands of row k were written."
    sections = [Section("Records", [table, how]), Section("Poses", figures)]
    return records_page(plan.platform.name, plan.seed, rows, sections)


def _figure(name: str, run: PlatformRun) -> Figure:
    """The true pose, and the commands."""
    panels = pose_panels({axis: (axis, run.t, run.signals[axis]) for axis in AXES})
    commands = {f"leg {i + 1}": (run.t, run.sent[:, i]) for i in range(LEGS)}
    return Figure(name, "time [s]", [*panels, signal_panel(SIGNALS["command"], commands)])
