"""A rig in the loop of its maker, as its label describes it, and ten seconds that its controller logged."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from workbench.commands.new.closed_loop import closed_loop_files
from workbench.engine import Engine
from workbench.engine.delay_line import held_commands
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.records import Record, write_csv
from workbench.records.excitation import multisine
from workbench.rigs.rig import Rig
from workbench.rigs.rig_file import load_rig, save_rig

LABEL = {"force": 1e5, "stroke": 0.15, "speed": 0.5, "M": 100.0}
PERIOD = 2e-3


def press(folder: Path) -> Rig:
    """The rig of the label, from a starter folder that is left in `folder`."""
    for name, text in closed_loop_files(LABEL, "press").items():
        (folder / name).write_text(text)
    return load_rig(folder / "rig.toml")


def played(own: Rig, pressure: float = 0.0) -> Record:
    """Ten seconds of the loop, as its maker's controller logs them; a `pressure` with that noise [Pa], if any."""
    plant = build(own)
    assert own.inner is not None
    t = np.arange(0, 10, PERIOD)
    reference = 3e-3 * multisine(1.0, 5.0, PERIOD, (0.2, 12.0), lines=40)
    reference = np.tile(reference / np.abs(reference).max(), 2)[: t.size] * 3e-3
    late = held_commands(np.append(t, t[-1] + PERIOD), reference / own.inner.full_command, plant.lateness())
    u = np.zeros((t.size, len(plant.inputs)))
    u[:, plant.input("command")] = late.mean
    x = Engine(plant).run(equilibrium(plant).x, t, u).x
    y, random = plant.observe(x, u), np.random.default_rng(3)
    sigma = {"position": 5e-6, **({"pa": pressure} if pressure else {})}
    seen = {name: y[:, plant.output(name)] + size * random.standard_normal(t.size) for name, size in sigma.items()}
    return Record("played", t, {"reference": reference, **seen})


def campaign(
    folder: Path, own: Rig, record: Record, change: Callable[[dict[str, np.ndarray]], None] | None = None
) -> Path:
    folder.mkdir()
    save_rig(own, folder / "rig.toml")
    (folder / "campaign.toml").write_text(
        'rig = "rig.toml"\n[records]\ntrain = [{file = "a.csv", to = 6.0}]\nheldout = [{file = "a.csv", from = 6.0}]\n'
    )
    signals = {name: values.copy() for name, values in record.signals.items()}
    if change:
        change(signals)
    write_csv(Record("a", record.t, signals), folder / "a.csv")
    return folder
