"""`make fuzz`: thousands of mutated inputs and random plants; what became of them, and which lines refused.

python tests/fuzz.py [INPUTS] [PLANTS]
"""

import os
import sys
import warnings
from collections import Counter, defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["JACKBENCH_TRUSTED"] = "*"  # as the tests have it

from judged_reading import raise_sites
from mutated_inputs import KINDS, ROOT, Result, examine, prepare, seeded
from random_plants import examine_plant

INPUTS, PLANTS = 20_000, 10_000
_SHOWN = 10  # failures


def fuzz_inputs(count: int, folder: Path) -> int:
    """Print the outcomes of mutated inputs, kind by kind; the number of failures."""
    sites: set[tuple[str, int]] = set()
    failed = 0
    each = -(-count // len(KINDS))
    for kind in KINDS:
        results = {seed: examine(kind, seeded(kind, seed), folder) for seed in range(each)}
        outcomes = Counter(result.outcome for result in results.values())
        print(
            f"{kind:12}" + "".join(f"{outcomes[name]:7} {name}" for name in ("valid", "refused", "failed")), flush=True
        )
        failed += _print_failures(kind, results)
        sites |= set().union(*(result.sites for result in results.values()))
    _print_coverage(sites)
    return failed


def fuzz_plants(count: int) -> int:
    """Print the outcomes of random plants; the number of failures."""
    balances = {seed: examine_plant(seed) for seed in range(count)}
    outcomes = Counter(balance.outcome for balance in balances.values())
    print("plants      " + "".join(f"{number:7} {name}" for name, number in outcomes.most_common()))
    wrong = {seed: balance for seed, balance in balances.items() if balance.is_wrong}
    for seed, balance in list(wrong.items())[:_SHOWN]:
        print(f"  plant {seed}: {balance}")
    return len(wrong)


def _print_failures(kind: str, results: dict[int, Result]) -> int:
    failures = {seed: result.failure for seed, result in results.items() if result.failure}
    for seed, failure in list(failures.items())[:_SHOWN]:
        print(f"  {kind} {seed}: {failure}")
    return len(failures)


def _print_coverage(sites: set[tuple[str, int]]) -> None:
    """The share of the `raise` statements that were reached, of every file of the workbench that refused anything."""
    reached = defaultdict(set)
    for file, line in sites:
        if Path(file).is_relative_to(ROOT / "workbench"):
            reached[file].add((file, line))
    known = {file: raise_sites(file) for file in sorted(reached)}
    hit = sum(len(known[file] & reached[file]) for file in known)
    print(f"reached {hit} of {sum(map(len, known.values()))} places that raise, in {len(known)} files; not reached:")
    for file, places in known.items():
        missed = sorted(line for _, line in places - reached[file])
        if missed:
            print(f"  {Path(file).relative_to(ROOT)}: {', '.join(map(str, missed))}")


def main(words: list[str]) -> int:
    """Both, with these numbers of inputs and plants; status 1 where any failed."""
    warnings.simplefilter("error")  # as the tests have it, too
    counts = [int(word) for word in words]
    inputs, plants = (*counts, *(INPUTS, PLANTS)[len(counts) :])
    with TemporaryDirectory() as folder:
        failed = fuzz_inputs(inputs, prepare(Path(folder) / "experiments"))
    failed += fuzz_plants(plants)
    print(f"{failed} failures")
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
