"""A pytest plugin that leaves the slowest tests of a run in durations.txt beside it, with their seconds by the clock.

`make durations` runs the whole suite with it. What a fixture takes counts for the test that asked for it first.
"""

from collections import Counter
from pathlib import Path

import pytest

_SHOWN = 40


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Called by pytest at the end of a run, with the reports of all workers."""
    seconds: Counter[str] = Counter()
    for report in (report for reports in terminalreporter.stats.values() for report in reports):
        if isinstance(report, pytest.TestReport):
            seconds[report.nodeid] += report.duration
    lines = [f"{taken:5.0f}  {test}\n" for test, taken in seconds.most_common(_SHOWN)]
    total = f"# {len(seconds)} tests took {seconds.total():.0f} s\n"
    Path(__file__).with_suffix(".txt").write_text(total + "".join(lines), "utf-8")
