"""The kinds of input that people write, each as seeded mutations of valid ones, and what the readers make of them."""

import shutil
import tomllib
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w
from judged_reading import TooSlow, bad_message, limited, peak_memory, sites, unbounded
from mutants import document
from mutated_tables import record_columns, sheet_columns, write_csv, write_mat, write_parquet

from workbench.base.errors import InputError
from workbench.base.units import to_si
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.inverse.options import InverseConfig
from workbench.commands.learn.options import load_any
from workbench.commands.robustness.options import load_any as load_robustness
from workbench.commands.run.options import load_config
from workbench.commands.sines.options import SinesConfig
from workbench.commands.train.options import load_train
from workbench.commands.tune.options import load_tune
from workbench.records import load_campaign, read_record
from workbench.records.columns import ColumnMap
from workbench.records.frequency_sheet import read_response, read_sheet
from workbench.records.sheet_points import read_points
from workbench.rigs.datasheet import load_datasheet
from workbench.rigs.rig_file import load_rig, rig_text

ROOT = Path(__file__).parents[1]
SECONDS, BYTES = 1.0, 500 * 2**20  # of the processor and of memory, for one reading
SLOW = ("measured_plant.toml",)  # fits a plant

LOADERS: dict[str, Callable[[Path], Any]] = {
    **dict.fromkeys(("step", "paper", "corrector"), load_config),
    "tune": load_tune,
    "train": load_train,
    "bench": BenchConfig.load,
    "learn": load_any,
    "inverse": InverseConfig.load,
    "robustness": load_robustness,
    "sines": SinesConfig.load,
    "new-rig": load_datasheet,
}
CAMPAIGN: dict[str, Any] = {
    "rig": "jack-10t",
    "score": "windows",
    "records": {
        "static": ["static.csv"],
        "train": ["a.csv", {"file": "b.csv", "from": 0.0, "to": 0.02}],
        "select": ["c.parquet"],
        "heldout": ["d.mat"],
    },
    "signals": {
        "position": {"column": "position", "unit": "mm", "scale": 1.0, "clip": [-100.0, 100.0]},
        "pa": {"column": "pa", "unit": "bar", "to": "bar", "scale": 1.0, "offset": 0.5},
        "pb": {"unit": "bar"},
        "command": {"unit": "1"},
    },
    "sessions": {"warm": {"records": ["b*"], "numbers": ["K3"], "temperature": "48 degC"}},
    "drifts": {"wear": {"records": ["a.csv", "d.mat"], "numbers": ["eps"], "per": "record"}},
    "sheets": [{"file": "sheet.csv", "input": "command", "output": "flow", "amplitude": 0.1}],
}


@dataclass(frozen=True)
class Result:
    """What became of an input: "valid", "refused" or "failed", the failure's own words, and the lines of the readers
    at which it was refused."""

    outcome: str
    failure: str = ""
    sites: frozenset[tuple[str, int]] = frozenset()


def rig_files() -> dict[str, dict[str, Any]]:
    """The bundled rigs and linear plants by name."""
    paths = [*(ROOT / "workbench" / "rigs").glob("*.toml"), *(ROOT / "experiments" / "plants").glob("*.toml")]
    return {path.name: tomllib.loads(path.read_text()) for path in sorted(paths)}


@cache
def experiment_files() -> dict[str, dict[str, Any]]:
    """The bundled experiments by name, those that any reader of LOADERS takes at once."""
    paths = (path for path in sorted((ROOT / "experiments").glob("*.toml")) if path.name not in SLOW)
    documents = {path.name: tomllib.loads(path.read_text()) for path in paths}
    return {name: tree for name, tree in documents.items() if tree.get("experiment") in LOADERS}


def read_rig(path: Path) -> Any:
    """A rig file, and back into text that is the same rig."""
    rig = load_rig(path)
    tomllib.loads(rig_text(rig))
    return rig


def read_any_sheet(path: Path) -> Any:
    """The three readers of a sheet of frequencies; all of them may refuse, one after the other."""
    errors, sheets = [], []
    for read in (read_sheet, read_points):
        try:
            sheets.append(read(path, None, "command", "flow"))
        except InputError as error:
            errors.append(error)
    sheets.append(read_response(path, "mm", "m"))
    if errors:
        raise errors[0]
    return sheets[::2]  # points may have gaps


def prepare(folder: Path) -> Path:
    """The bundled experiments beside which mutated ones are put, and what is slow only the first time."""
    shutil.copytree(ROOT / "experiments", folder, ignore=shutil.ignore_patterns("*.png", "*.gz", "README.md"))
    to_si(1.0, "furlong", "m")
    for tree in experiment_files().values():
        _written(folder / "mutant.toml", tree)
        LOADERS[tree["experiment"]](folder / "mutant.toml")
    for kind in ("csv", "parquet", "mat"):
        for seed in range(20):
            examine(kind, seeded(kind, seed), folder, seconds=60.0)
    return folder


def seeded(kind: str, seed: int) -> Random:
    """The random numbers of one mutation."""
    return Random(f"{kind} {seed}")


def rig_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    tree = random.choice(list(rig_files().values()))
    return _bytes(folder / "mutant.toml", document(tree, random)), read_rig


def experiment_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    tree = random.choice(list(experiment_files().values()))
    return _bytes(folder / "mutant.toml", document(tree, random)), LOADERS[tree["experiment"]]


def campaign_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    """A campaign of five records and a sheet, which are valid."""
    files = {name: folder / name for name in ("static.csv", "a.csv", "b.csv", "c.parquet", "d.mat", "sheet.csv")}
    if not files["d.mat"].exists():
        _valid_records(files)
    return _bytes(folder / "campaign.toml", document(CAMPAIGN, random)), load_campaign


def csv_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    return write_csv(folder / "mutant.csv", random, record_columns(random)), read_record


def parquet_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    return write_parquet(folder / "mutant.parquet", random), read_record


def mat_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    units = {"command": "1", "pa": "bar", "pb": "bar", "position": "mm"}
    mapping = {name: ColumnMap(unit=unit) for name, unit in units.items()}
    return write_mat(folder / "mutant.mat", random), partial(read_record, mapping=mapping)


def sheet_mutant(random: Random, folder: Path) -> tuple[Path, Callable[[Path], Any]]:
    return write_csv(folder / "mutant_sheet.csv", random, sheet_columns(random)), read_any_sheet


KINDS: dict[str, Callable[[Random, Path], tuple[Path, Callable[[Path], Any]]]] = {
    "rig": rig_mutant,
    "experiment": experiment_mutant,
    "campaign": campaign_mutant,
    "csv": csv_mutant,
    "parquet": parquet_mutant,
    "mat": mat_mutant,
    "sheet": sheet_mutant,
}


def examine(kind: str, random: Random, folder: Path, seconds: float = SECONDS) -> Result:
    """Read one mutated input: it is valid, or refused in one line within the time and the memory, or else a failure.

    `KINDS[kind](random, folder)` with the same random numbers writes the same file again.
    """
    path, read = KINDS[kind](random, folder)
    memory = peak_memory()
    result = _outcome(path, read, seconds)
    if peak_memory() - memory > BYTES:
        return Result("failed", f"{(peak_memory() - memory) // 2**20} MiB")
    return result


def _outcome(path: Path, read: Callable[[Path], Any], seconds: float) -> Result:
    try:
        with limited(seconds):
            value = read(path)
    except InputError as error:
        failure = bad_message(str(error))
        return Result("failed" if failure else "refused", failure, frozenset(sites(error)))
    except (Exception, TooSlow) as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return Result("failed", f"{type(error).__name__}: {str(error)[:200]} ({where.filename}:{where.lineno})")
    number = unbounded(value)
    return Result("failed", f"valid with {number}") if number else Result("valid")


def _valid_records(files: dict[str, Path]) -> None:
    """Valid files of the campaign, each with other samples."""
    for seed, (name, path) in enumerate(files.items()):
        columns = sheet_columns(Random(seed)) if name == "sheet.csv" else record_columns(Random(seed))
        if path.suffix == ".parquet":
            pq.write_table(pa.table(dict(columns)), path)
        elif path.suffix == ".mat":
            with h5py.File(path, "w") as file:
                for cell, values in columns:
                    file[cell.split(" [")[0]] = np.array(values)
        else:
            rows = zip(*(values for _, values in columns), strict=True)
            path.write_text("\n".join([",".join(c for c, _ in columns), *(",".join(map(str, row)) for row in rows)]))


def _written(path: Path, tree: dict[str, Any]) -> Path:
    return _bytes(path, tomli_w.dumps(tree).encode())


def _bytes(path: Path, raw: bytes) -> Path:
    path.write_bytes(raw)
    return path
