"""Recordings of a rig in simulation: its drive plays excitations, its sensors log them, a campaign folder is left."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...base.toml_text import toml_text
from ...base.units import from_si
from ...linear import equilibrium
from ...loop.sampled_loop import LoopRun
from ...loop.sensors import logged
from ...plant import build
from ...records import Record
from ...records.campaign import ROLES
from ...records.excitation import Excitation, excitation, excitation_text, multisine
from ...records.frequency_sheet import table_text
from ...report import Curve, Figure, Page, Panel, Section, Table
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..excite.study import DriveSimulation, drive, effort, play, trouble, within_limits
from .config import OWN, Plan

LARGEST = 0.4  # of full command: no move is faster
COMMANDS = LARGEST * np.array([0.005, 0.0125, 0.025, 0.05, 0.125, 0.25, 0.5, 1.0])  # between which speeds are straight
PUSH = 0.25  # of the force that the supply can give on the smaller side, to accelerate with
TRAVEL = 0.6  # of the stroke limit: how far a move goes, or as far as the fastest gets in TRAVEL_TIME
TRAVEL_TIME = 0.2  # s
STEPS = (
    (1.0, 0.4), (-0.2, 0.1), (-1.0, 0.2), (-0.8, 0.4), (0.05, 0.03), (0.45, 0.1), (1.0, 0.3), (-0.05, 0.05),
    (0.35, 0.15), (-0.8, 0.3),
)  # fmt: skip
"""Displacement over the travel, and the command whose steady speed it is made at."""
TRIANGLES = ((0.04, 0.25), (0.02, 0.4), (0.008, 0.7))
"""Command, and seconds from 0 to the peak: fast to so slow that friction shows."""
REST = 2.0  # s
LASTS = 6.0  # s, at least, of steps and triangles
STEP_REST = 0.45  # s
SECONDS, REPEAT = 2.0, 4  # of the multisine: one period, and how many
SLOW, FAST, LINES, FINE = (0.5, 3.0), (5.0, 250.0), 50, 0.03  # Hz on the reference; Hz, lines and peak on the command


def run_record(plan: Plan, stage: Stage, progress: Progress) -> Outcome:
    """Play and log every excitation; the last one is held out, `static` measures the noise, the others are train."""
    progress("excitations")
    ready = drive(plan.rig)
    played = {"static": _still(plan.rig)} | (_given(plan) or _standard(ready, stage))
    records, rows = [], []
    for number, (name, wave) in enumerate(played.items()):
        progress(f"{name}: {wave.t[-1]:.3g} s")
        stored = stage(f"record-{name}", partial(recorded, ready, wave, [plan.seed, number]))
        records.append(Record(name, wave.t, stored["signals"]))
        rows.append({"record": name, "role": _role(name, list(played)), **stored["effort"]})
    metrics = {"rows": rows, "seed": plan.seed, "loop_gain": ready.loop.design.gain}
    files = _files(plan, rows, records, played)

    def draw() -> tuple[Page, Figure]:
        return _page(plan, ready, rows, records), recorded_figure(records[-1])

    return Outcome(metrics, draw, files=files, subject=Subject(plan.rig))


def _given(plan: Plan) -> dict[str, Excitation]:
    return {excitation.name: excitation for excitation in plan.files}


def _standard(ready: DriveSimulation, stage: Stage) -> dict[str, Excitation]:
    """The standard set, worked out once."""

    def compute() -> dict[str, dict[str, np.ndarray]]:
        return {n: {"reference": e.reference, "command": e.command} for n, e in standard_set(ready).items()}

    period = ready.rig.period.value
    return {name: Excitation(name, period, **columns) for name, columns in stage("excitations", compute).items()}


def _files(
    plan: Plan, rows: list[dict[str, Any]], records: Sequence[Record], played: Mapping[str, Excitation]
) -> dict[str, str]:
    """The campaign folder: campaign.toml, a file a record, what was played, and the rig where it is not bundled."""
    roles = {role: [f"{row['record']}.csv" for row in rows if row["role"] == role] for role in ROLES}
    campaign = toml_text({"rig": plan.declared, "records": roles})
    files = {"campaign.toml": f"# simulated by `jackbench record`, seed {plan.seed}\n{campaign}"}
    files |= {f"{record.name}.csv": table_text({"t": record.t, **record.signals}) for record in records}
    files |= {f"played-{name}.csv": excitation_text(played[name]) for name in played if name != "static"}
    if plan.declared == OWN:
        files[OWN] = rig_text(replace(plan.rig, effects=()))
    if plan.rig.effects:
        files["truth.toml"] = rig_text(plan.rig)
    return files


def standard_set(drive: DriveSimulation) -> dict[str, Excitation]:
    """Steps and triangles of 6 s, and four periods of a 2 s multisine, as large as the rig takes them.

    The reference moves at steady speeds that the table's commands give, on edges that PUSH allows, and the command of
    each speed is added: the valve opens as far as the table says, however slow the position loop is. The multisine
    moves the reference in 0.5-3 Hz, as fast as the steps, so that the valve works away from null, and adds 5-250 Hz to
    the command.
    """
    rig, period = drive.rig, drive.rig.period.value
    pace = _Pace(replace(rig, effects=()))  # a drive is set to what its rig is declared to be
    travel = min(TRAVEL * rig.limit("stroke"), pace.speed(LARGEST) * TRAVEL_TIME)
    steps = [np.concatenate((pace.move(part * travel, size), _rows(STEP_REST, period))) for part, size in STEPS]
    triangles = [
        pace.move(side * pace.speed(size) * seconds, size) for size, seconds in TRIANGLES for side in (1, -2, 1)
    ]
    slow = pace.multisine(travel)
    wave = multisine(FINE, SECONDS, period, (FAST[0], min(FAST[1], 0.25 / period)), lines=LINES)
    added = np.append(np.tile(wave, REPEAT), 0.0)
    designs = (
        pace.moving("steps", steps),
        pace.moving("triangle", triangles),
        replace(slow, command=slow.command + added),
    )
    excitations = {}
    for design in designs:
        fitting = within_limits(drive, design)
        if fitting is None:
            why = trouble(play(drive, design))
            raise InputError(f"rig {rig.name}: cannot play {design.name} at any size: {why}; check limits and effects")
        excitations[design.name] = fitting
    return excitations


class _Pace:
    """Speeds that a rig's commands give, and moves at them."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self._period = rig, rig.period.value
        plant = build(rig)
        smooth = plant.without_dry_friction()
        commands = np.concatenate((-COMMANDS[::-1], [0.0], COMMANDS))
        speeds = [equilibrium(plant, command=c, p=smooth).speed if c else 0.0 for c in commands]
        self._commands, self._speeds = commands, np.array(speeds)
        self._acceleration = PUSH * (rig["Ps"] - rig["Pr"]) * min(rig.areas) / rig["M"]

    def speed(self, command: float) -> float:
        """Steady speed [m/s], never above half the rig's limit."""
        limit = 0.5 * self._rig.limit("speed")
        return float(np.clip(np.interp(command, self._commands, self._speeds), -limit, limit))

    def move(self, displacement: float, command: float) -> np.ndarray:
        """Velocities [n] m/s of a move at the speed of `command`, slower where its edges leave no room."""
        side = np.sign(displacement)
        speed = min(abs(self.speed(side * command)), np.sqrt(2 * self._acceleration * abs(displacement) / np.pi))
        edge = max(1, round(np.pi / 2 * speed / self._acceleration / self._period))
        flat = max(0, round(abs(displacement) / speed / self._period) - edge)
        rise = np.sin(np.pi / 2 * (np.arange(edge) + 0.5) / edge) ** 2
        shape = np.concatenate((rise, np.ones(flat), rise[::-1]))
        return displacement * shape / (shape.sum() * self._period)

    def multisine(self, travel: float) -> Excitation:
        """The slow part of the multisine: within the travel, the largest speed and the push."""
        period = self._period
        wave = multisine(1.0, SECONDS, period, SLOW, "1/f")
        velocity = np.gradient(wave, period)
        fastest = min(self.speed(LARGEST), abs(self.speed(-LARGEST))) / np.abs(velocity).max()
        size = min(travel, fastest, self._acceleration / np.abs(np.gradient(velocity, period)).max())
        return self.moving("multisine", [np.tile(np.diff(size * wave, append=0.0) / period, REPEAT)])

    def moving(self, name: str, velocities: Sequence[np.ndarray]) -> Excitation:
        """The reference that moves so, and the command that makes it move so; padded to LASTS, at rest at the end."""
        velocity = np.concatenate(velocities)
        still = np.zeros(max(1, round(LASTS / self._period) - velocity.size))
        velocity = np.concatenate((velocity, still))
        travelled = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * self._period
        command = np.interp(velocity, self._speeds, self._commands)
        return Excitation(name, self._period, self._rig["xmid"] + travelled, command)


def _logged(drive: DriveSimulation, run: LoopRun, seed: int) -> dict[str, np.ndarray]:
    """What the rig's sensors log of a run that the loop measured with the same seed, [n] SI by signal.

    Row k is y = h(x(t_k), u_k), after writing u_k, and its noise is the one that the controller met at t_k: a loop logs
    the sample that it acts on. A load cell without a specimen says nothing and is left out.
    """
    rig = drive.rig
    readings = logged(run.record.signals, rig, drive.engine.plant.outputs, seed)
    idle = ("force",) if rig["ks"] == 0 and rig["cs"] == 0 else ()
    given = {name: run.record.signals[name] for name in ("reference", "command")}
    return given | {name: values for name, values in readings.items() if name not in idle}


def recorded(drive: DriveSimulation, excitation: Excitation, entropy: list[int]) -> dict[str, Any]:
    """An excitation as the rig's sensors log it, `signals`, with the `effort` it took. Raises InputError for a trip."""
    seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
    run = play(drive, excitation, seed)
    if run.tripped is not None:
        raise InputError(
            f"{excitation.name}: on {drive.rig.name}, {trouble(run)}; make it smaller, or check the rig's limits"
        )
    return {"signals": _logged(drive, run, seed), "effort": effort(run, drive.rig)}


def _rows(seconds: float, period: float) -> np.ndarray:
    return np.zeros(round(seconds / period))


def _still(rig: Rig) -> Excitation:
    return excitation("static", "command", _rows(REST, rig.period.value), rig.period.value, rig["xmid"])


def _role(name: str, names: list[str]) -> str:
    if name == "static":
        return "static"
    return "heldout" if name == names[-1] else "train"


def _page(plan: Plan, drive: DriveSimulation, rows: list[dict[str, Any]], records: Sequence[Record]) -> Page:
    table = Table(
        "What was recorded",
        ["record", "role", "duration [s]", "position within [mm]", "speed [m/s]", "command [1]", "lowest [bar]",
         "limited [s]"],
        [list(row.values()) for row in rows],
        note="Lowest of all chamber pressures. Limited: the guard changed the command.",
    )  # fmt: skip
    how = (
        f"The drive holds the jack by a position loop of {drive.loop.design.gain:g} 1/m and adds the played command to "
        "it. Row k of a record is what the sensors say at t_k right after command k was written, with the noise and "
        "the resolution of the rig file. The played-*.csv files are what a drive plays to record the same on a rig."
    )
    notes = [how]
    if plan.rig.effects:
        names = ", ".join(use.name for use in plan.rig.effects)
        notes.append(
            f"Recorded with {names}. rig.toml, which campaign.toml names, is without; truth.toml is as simulated."
        )
    verdict = f"{len(rows)} simulated records of {plan.rig.name}, seed {plan.seed}; {rows[-1]['record']} is held out."
    sections = [
        Section("Records", [table, *notes]),
        Section("Signals", [recorded_figure(record) for record in records]),
    ]
    return Page(f"Recordings of {plan.rig.name}", verdict, sections)


def recorded_figure(record: Record) -> Figure:
    """All signals of a record."""

    def shown(name: str) -> np.ndarray:
        return from_si(record.signals[name], SIGNALS[name].unit, SIGNALS[name].si)

    followed = [name for name in ("reference", "position") if name in record.names]
    panels = [
        Panel(SIGNALS["position"].label, [Curve(name, record.t, shown(name)) for name in followed]),
        Panel(SIGNALS["command"].label, [Curve("command", record.t, shown("command"))]),
    ]
    panels += [
        Panel(SIGNALS[name].label, [Curve(name, record.t, shown(name))])
        for name in record.names
        if name not in ("reference", "position", "command")
    ]
    return Figure(record.name, "time [s]", panels)
