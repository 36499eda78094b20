"""Experiments of a starter folder, each made of what its kind declares: its keys in order, with what they mean."""

import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Any

from ...base.errors import InputError
from ...base.toml_text import toml_text
from ..common.bench_experiment import BenchConfig
from ..common.declared import Experiment, meanings
from ..common.new_folder import write_folder
from ..common.step_experiment import StepConfig
from ..faults.options import FaultsConfig
from ..inverse.options import InverseConfig
from ..learn.options import LearnConfig, PlatformLearnConfig
from ..robustness.options import PlatformRobustness, RobustnessConfig
from ..run.automatic_config import AutomaticConfig
from ..run.options import CorrectorConfig, PaperConfig
from ..run.platform_config import PlatformConfig
from ..sines.options import SinesConfig
from ..train.options import TrainConfig
from ..tune.options import TuneConfig

TEMPLATES = files("workbench") / "commands" / "new" / "template"
_JACK = (StepConfig, TuneConfig, BenchConfig, RobustnessConfig, FaultsConfig, SinesConfig, LearnConfig, InverseConfig)
_FURTHER = (TrainConfig, AutomaticConfig, CorrectorConfig, PaperConfig)
KINDS: Mapping[str, Mapping[str, type[Experiment]]] = {
    "jack": {f"{kind.KIND}.toml": kind for kind in (*_JACK, *_FURTHER)},
    "platform": {"run.toml": PlatformConfig, "robustness.toml": PlatformRobustness, "learn.toml": PlatformLearnConfig},
}  # of a jack and of a platform, by their files


def experiments(of: str, numbers: Mapping[str, str], beside: Mapping[str, str]) -> dict[str, str]:
    """The text of each experiment of a "jack" or a "platform" by its file, with the files `beside` it: of those that
    the rig can play, for not every one has pressures to feed back, or a pilot."""
    starts = tomllib.loads(Template((TEMPLATES / f"{of}.toml").read_text("utf-8")).substitute(numbers))
    texts = {name: starter(kind, {**starts["every"], **starts[name]}) for name, kind in KINDS[of].items()}
    with TemporaryDirectory() as place:
        write_folder(folder := Path(place) / "all", {**beside, **texts})
        for name, kind in KINDS[of].items():
            try:
                kind.load(folder / name)
            except InputError:
                del texts[name]
    return texts


def starter(kind: type[Experiment], starts: Mapping[str, Any]) -> str:
    """The text of an experiment of a kind whose keys have the values of `starts`; the others are named at its end."""
    said = meanings(kind)
    taken = {key: starts[key] for key in said if key in starts and key not in starts.get("without", ())}
    more = [f"#   {key}: {text}" for key, text in said.items() if key not in taken and key != "experiment"]
    about = [f"# {line}" for line in starts["about"].splitlines()]
    lines = [*about, *_commented({"experiment": kind.KIND, **taken}, said), "", "# It takes further keys:", *more]
    return "\n".join(lines) + "\n"


def _commented(document: Mapping[str, Any], said: Mapping[str, str]) -> Iterator[str]:
    """The lines of a document, each key of its own with what is said of it."""
    left, is_inside = dict(said), False
    for line in toml_text(document).splitlines():
        is_inside |= line.startswith("[")
        key = line.strip("[]").partition(".")[0] if line.startswith("[") else line.partition(" =")[0]
        meaning = left.pop(key, "") if line.startswith("[") or not is_inside else ""
        yield f"{line:<32} # {meaning}" if meaning else line
