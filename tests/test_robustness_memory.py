"""What robustness keeps of its plants is on disk; memory grows by a few numbers a plant, while rows are made."""

import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from workbench.base.kept_columns import KeptColumns
from workbench.commands.common.run_folder import open_run
from workbench.commands.robustness.options import RobustnessConfig
from workbench.loop.robustness.row import Kept, kept_row
from workbench.loop.robustness.workers import linear_stage, steps_stage

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
BLOCK = 1000
FLOATS = "settling_s", "overshoot_percent", "lowest_pressure", "held_ms"


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    start = (EXPERIMENTS / "robustness.toml").read_text().split("[from]")[0]
    path = tmp_path_factory.mktemp("one") / "one.toml"
    path.write_text(f'{start}[from]\n"{EXPERIMENTS}/position_tuned.toml" = ["p-dp"]\n')
    return RobustnessConfig.load(path)


def results(kept, block):
    """What the stages of a block of plants leave, made up."""
    random = np.random.default_rng(block.start)
    loops = {name: random.uniform(0.5, 0.9, BLOCK) for name in ("radius", "ms", "gain_margin_db", "phase_margin_deg")}
    linear = {linear_stage(place, kept.delay, block): {kept.spec.name: loops} for place in kept.at}
    steps = {name: random.uniform(0.0, 1.0, BLOCK) for name in FLOATS}
    steps |= {"hunting": random.uniform(size=BLOCK) < 1e-3, "cpu_seconds": np.ones(1)}
    steps |= dict.fromkeys(("tripped", "held_unstable"), np.zeros(BLOCK, bool))
    return linear | {steps_stage(kept.spec, kept.delay, block): steps}


def taken(config, blocks):
    """So many blocks of plants kept, and the bytes that stay in memory for them."""
    kept = Kept.of(config.controllers[0], config)
    kept.take(results(kept, range(BLOCK)), range(BLOCK))
    tracemalloc.start()
    for first in range(BLOCK, blocks * BLOCK, BLOCK):
        block = range(first, first + BLOCK)
        kept.take(results(kept, block), block)
    stays = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return kept, stays


def peak(work):
    """The bytes that some work needs at once."""
    tracemalloc.start()
    work()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def bytes_a_plant(kept):
    return sum(column.nbytes for columns in (kept.lanes, kept.loops) for column in columns.values()) // (40 * BLOCK)


def test_blocks_of_plants_leave_nothing_in_memory(config):
    """A block has 1000 plants of 12 places and of a step: 480 kB of numbers."""
    (_, few), (_, many) = taken(config, 3), taken(config, 40)
    assert many < few + 20e3


def test_the_rows_of_a_controller_need_a_few_numbers_a_plant_at_once(config):
    """Of the 156 bytes that are kept of one, as the page says; so the rows of a million plants need 35 MB."""
    kept, _ = taken(config, 40)
    assert bytes_a_plant(kept) == 156
    assert (
        f"{bytes_a_plant(kept)} bytes for each law" in (EXPERIMENTS.parent / "docs/results/robustness.md").read_text()
    )
    assert peak(kept.linear_rows) < 20 * 40 * BLOCK
    assert peak(lambda: kept_row(kept, config, None)) < 35 * 40 * BLOCK
    row = kept_row(kept, config, None)
    assert row["plants"] == 40 * BLOCK
    assert row["settling_p50_s"] == pytest.approx(0.5, abs=0.02)


def test_a_table_on_disk_is_written_part_by_part(tmp_path):
    columns = KeptColumns()
    values = np.arange(50_000.0)
    with open_run(tmp_path / "out", {"command": "robustness"}) as run:
        run.keep({}, "", {"first": {"what": values}})  # what the writer loads once
        for k in range(6):
            columns.append({f"c{i}": values + 1e6 * k + i for i in range(10)} | {"even": values % 2 == 0})
        most = peak(lambda: run.keep({}, "", {"plants": columns}))
        run.finish({}, "", {"plants": columns}, "")
    assert most < 2.5 * 2**16 * 81  # of 4.6 parts, one and the next
    table = pq.read_table(tmp_path / "out" / "plants.parquet")
    assert list(table.column_names) == list(columns)
    for name, kept in columns.items():
        np.testing.assert_array_equal(table[name].to_numpy(), kept)
