"""The file of a knowledge experiment: searches, and how well the rig's numbers are known."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workbench.base.table import ConfigTable
from workbench.commands.common.envelope_keys import MOST_PLANTS
from workbench.commands.common.experiment_file import read_experiment
from workbench.commands.tune.options import TuneConfig, load_tune
from workbench.loop.rig_variations import ALL, known_to
from workbench.loop.tuning.problem import TuneProblem
from workbench.rigs.rig import Rig

KEYS = ("experiment", "searches", "known", "designs", "plants", "seed")


@dataclass(frozen=True)
class KnowledgeConfig:
    """Searches of one signal on one rig, each of so many `designs`, and the shares of their ranges to which the numbers
    are known, the largest first; the designs are played on so many `plants`, drawn by `seed`.

    `source` is the experiment as it was read, with the files of its searches.
    """

    searches: tuple[TuneConfig, ...]
    known: tuple[float, ...]
    plants: int
    seed: int
    source: Mapping[str, Any]

    @property
    def rig(self) -> Rig:
        """The nominal one of all searches."""
        return self.searches[0].start.rig


def load_knowledge(path: str | Path, rig: str | None = None, plants: int | None = None) -> KnowledgeConfig:
    """Read the file; `rig` and `plants` replace what it and its searches say. Raises InputError with file and key."""
    path = Path(path)
    top = read_experiment(path)
    top.word("experiment", ["knowledge"])
    top.allow(*KEYS)
    files = top.words("searches", "tune_p_dp.toml")
    designs = top.count("designs", 1, 100_000)
    searches = tuple(replace(load_tune(path.parent / file, rig), designs=designs) for file in files)
    _check(top, dict(zip(files, searches, strict=True)))
    source = {**top.values, "searches": {file: search.source for file, search in zip(files, searches, strict=True)}}
    plants = plants or top.count("plants", 1, MOST_PLANTS)
    return KnowledgeConfig(searches, _shares(top), plants, top.count("seed", 0), source)


def known_problem(search: TuneConfig, share: float, start: Mapping[str, float]) -> TuneProblem:
    """A search where the numbers of the rig are known to +-`share` of their ranges, from a design by its numbers."""
    problem = search.problem
    rig, factors = known_to(problem.rig, problem.factors, share)
    searched = tuple(replace(number, start=start[number.name]) for number in problem.searched)
    return replace(problem, rig=rig, rigs={"nominal": rig}, factors=factors, searched=searched)


def _shares(top: ConfigTable) -> tuple[float, ...]:
    percents = top.numbers("known", "[50, 20, 5]")
    if not percents or not all(0 <= percent <= ALL for percent in percents) or len(set(percents)) < len(percents):
        raise top.complaint("known", "different numbers from 0 to 50: to +- so many percent of its range each is known")
    return tuple(percent / 100 for percent in sorted(percents, reverse=True))


def _check(top: ConfigTable, searches: Mapping[str, TuneConfig]) -> None:
    """Raises InputError for searches that cannot stand in one picture."""
    first, *others = searches
    for file in others:
        for what, part in (("rig", _rig), ("[within]", _factors), ("scenario", _step)):
            if part(searches[file]) != part(searches[first]):
                raise top.complaint("searches", f"{file} and {first} differ in their {what}; make two experiments")
    if not _step(searches[first]).is_step:
        raise top.complaint("searches", f"the first scenario of {first} must be a step; put one in front")
    names = [search.name for search in searches.values()]
    if len(set(names)) < len(names):
        raise top.complaint("searches", "two controllers of one name; give one of them another")


def _rig(search: TuneConfig) -> Any:
    return search.start.rig.table()


def _factors(search: TuneConfig) -> Any:
    return search.factors


def _step(search: TuneConfig) -> Any:
    return search.start.scenarios[0]
