"""Loops beside each other, on a set of rigs in scenarios, by the code of `jackbench bench`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..base.checkpoint import no_checkpoint
from ..base.columns import data_frame
from ..commands.bench.study import run_bench
from ..commands.common.bench_experiment import BenchConfig, BenchLoop
from ..commands.common.experiment import BodeConfig
from ..commands.common.outcome import Answer, Outcome
from ..loop.reach import check_reach
from ..loop.scenarios import Scenario
from ..report import Table
from .closed_loop import ClosedLoop
from .loops import loops_of_one_rig, named_controllers
from .search import checked_rigs, scenarios_of
from .time_response import metrics_table

if TYPE_CHECKING:
    import pandas  # pyright: ignore[reportMissingImports]

_NO_SINES = BodeConfig(0.1, 50.0, 3, ())


@dataclass(frozen=True, eq=False, repr=False)
class Benchmark(Answer):
    """Loops of one signal on a set of rigs: `rows` are those of metrics.json, `outcome` the whole report."""

    config: BenchConfig
    outcome: Outcome

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row for each controller, rig and scenario: SI but for what a key says."""
        return list(self.outcome.metrics["rows"])

    def table(self) -> Table:
        """The rows in short."""
        return metrics_table(self.rows, self.config.loops[0].signal, "controller", "rig", "scenario")

    def to_pandas(self) -> "pandas.DataFrame":
        """The rows. Raises InputError where pandas is not installed."""
        return data_frame({key: [line[key] for line in self.rows] for key in self.rows[0]})

    def __repr__(self) -> str:
        return f"{self.outcome.page.verdict}\n{self.table()!r}"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_() + self.plot()._repr_html_()


def benchmark(
    loops: ClosedLoop | Sequence[ClosedLoop],
    rigs: Sequence[str] = ("nominal",),
    scenarios: Sequence[str | Scenario] | None = None,
    seed: int = 0,
    jobs: int = 1,
) -> Benchmark:
    """Loops of one signal on one rig, beside each other.

    Parameters
    ----------
    loops
        One loop or several.
    rigs
        Names of the set that is made of the rig, nominal first (see RIG_SET).
    scenarios
        Names or Scenarios; a step of 10 mm or 20 kN where none are given.
    seed
        Seed of the sensors' noise.
    jobs
        Worker processes.

    Returns
    -------
    A row for each loop, rig and scenario, and the report.

    Raises
    ------
    InputError
        For loops of two rigs or signals.
    """
    loops = loops_of_one_rig(loops, "benchmark")
    first = loops[0]
    asked = scenarios_of(first, scenarios, "benchmark")
    members = checked_rigs(first, rigs, "benchmark")
    for member in members.values():
        for each in asked:
            check_reach(each, member)
    bench = BenchLoop(first.signal, first.rig, members, named_controllers(loops), asked, _NO_SINES)
    config = BenchConfig(rig=first.rig, loops=(bench,), conditions=first.conditions(seed))
    return Benchmark(config, run_bench(config, no_checkpoint, lambda _: None, jobs))
