"""The metrics with their units and meanings, from the one table that reports and `compare` read."""

from workbench.loop.metrics import METRICS, SIGNAL, SIGNAL_TIME, STATISTICS, Metric

from .markdown import code, page, plain, table

_INTRODUCTION = """The keys of the rows of `metrics.json`. Numbers are in the unit of this page; a report shows them in
a unit that people read, to what the sensors resolve. A number that does not exist is null: a loop that never settles
has `"settling_s": null`. `jackbench compare` says in which run a metric is better."""

_STATISTICS = (
    "A word within a key says which statistic over plants or rigs it is: `settling_p99_s` is one of `settling_s`."
)

_UNITS = {SIGNAL: "SI of the controlled signal", SIGNAL_TIME: "SI of the controlled signal, times s", "": ""}


def pages() -> dict[str, str]:
    """A table of the metrics, and one of their statistics."""
    metrics = table(("key", "name", "unit", "better", "meaning"), map(_row, METRICS.values()))
    statistics = table(("word", "statistic"), [[code(word), plain(name)] for word, name in STATISTICS.items()])
    return {"metrics.md": page("Metrics", _INTRODUCTION, metrics, "## Statistics", _STATISTICS, statistics)}


def _row(of: Metric) -> list[str]:
    return [code(of.key), plain(of.name), plain(_UNITS.get(of.unit, of.unit)), of.better, plain(of.meaning)]
