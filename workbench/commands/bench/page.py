"""The report of a bench: tables of controllers with the best of each column marked, figures, and every row."""

from collections.abc import Mapping
from typing import Any, Literal

from ...loop.scenarios import Scenario
from ...report import Figure, Page, Section, Table
from ..common.bench_experiment import BenchConfig, BenchLoop
from ..common.fitted_plant import with_fit
from ..common.judged import gas_words, judged_words
from ..common.metric_table import MARGINS, MetricView
from .entry import Entries
from .figures import excursion, linear_figures, sine_figures, spread_scatter, stiffness_figure, time_responses
from .nichols import nichols
from .verdict import Clouds, verdict_picture, verdict_sections, verdict_sentence

Metrics = Mapping[str, Any]
Best = Literal["min", "max"]


def bench_page(config: BenchConfig, entries: Entries, clouds: Clouds, metrics: Metrics) -> Page:
    """The report, from what a bench stored by controller and rig and over the envelope, and its metrics."""
    sections = []
    for loop in config.loops:
        title = f"{loop.signal.name.capitalize()} loops"
        first = loop.first
        sections += [
            *verdict_sections(loop, clouds, metrics),
            Section(title, [*_firsts_beside_verdict(loop, metrics), *_summary(config, loop, entries, metrics)]),
            Section(
                f"{title}: time responses on {first}",
                [time_responses(loop, scenario, first, entries) for scenario in loop.scenarios],
            ),
            Section(
                f"{title}: over the rigs", [spread_scatter(loop, scenario, entries) for scenario in _arriving(loop)]
            ),
            Section(f"{title}: linear, at null, on {first}", linear_figures(loop, first, entries)),
            Section(f"{title}: closed loop by stepped sine, on {first}", sine_figures(loop, entries)),
            Section(f"{title}: Nichols chart", [nichols(loop, first, entries)]),
            Section(f"{title}: dynamic stiffness", [stiffness_figure(loop, name, entries) for name in loop.rigs]),
            Section(f"{title}: fallbacks", _fallbacks(loop, metrics)),
            Section(f"{title}: every row", _every(loop, metrics)),
        ]
    sections = [section for section in sections if section.items]
    return with_fit(Page(f"Bench on {config.rig.name}", _verdict(config, metrics), sections), config.rig)


def bench_picture(config: BenchConfig, entries: Entries, metrics: Metrics) -> Figure:
    """The telling figure, of the first loop: Ms against settling over the envelope; where that was not judged, or tells
    of one controller alone, the last step on the first rig."""
    loop = config.loops[0]
    if (picture := verdict_picture(loop, metrics)) is not None:
        return picture
    steps = [scenario for scenario in loop.scenarios if scenario.is_step] or list(loop.scenarios)
    return time_responses(loop, steps[-1], loop.first, entries)


def _arriving(loop: BenchLoop) -> list[Scenario]:
    return [scenario for scenario in loop.scenarios if scenario.arrives is not None]


def _verdict(config: BenchConfig, metrics: Metrics) -> str:
    """Which controller each loop should have over stroke and rigs; where that was not judged, who is first."""
    several = len(config.loops) > 1
    sentences = {loop.signal.name: verdict_sentence(loop, metrics) or _firsts(loop, metrics) for loop in config.loops}
    said = [f"{name.capitalize()}: {text}" if several else text for name, text in sentences.items() if text]
    return " ".join(said) or "No scenario ends, so nothing settles."


def _firsts_beside_verdict(loop: BenchLoop, metrics: Metrics) -> list[str]:
    """Who is first, where the page's verdict says something else."""
    return [_firsts(loop, metrics)] if verdict_sentence(loop, metrics) else []


def _firsts(loop: BenchLoop, metrics: Metrics) -> str:
    """Who is quickest where it is slowest, in each scenario that ends."""
    return " ".join(_first(loop, scenario, metrics) for scenario in _arriving(loop))


def _first(loop: BenchLoop, scenario: Scenario, metrics: Metrics) -> str:
    rows = [row for row in metrics["rows"] if row["scenario"] == scenario.name and row["stable"] is not False]
    settled = {(row["controller"], row["rig"]): row for row in rows if row["settling_s"] is not None}
    never = [rig for rig in loop.rigs if not any((c.name, rig) in settled for c in loop.controllers)]
    rigs = [rig for rig in loop.rigs if rig not in never]
    able = [c.name for c in loop.controllers if all((c.name, rig) in settled for rig in rigs)]
    if not rigs:
        return f"{scenario.name}: no stable controller settles."
    nobody = f"on {', '.join(never)} no stable controller settles; " if never else ""
    if not able:
        return f"{scenario.name}: {nobody}no stable controller settles on every {'other ' * bool(never)}rig."
    worst = {name: max(settled[name, rig]["settling_s"] for rig in rigs) for name in able}
    best = min(worst, key=lambda name: worst[name])
    where = "on every other rig" if never else "on every rig"
    far, view = excursion(scenario), MetricView.of(loop.rig, loop.signal)
    name = "overshoot" if scenario.size else "deviation"
    most = view.text(max(settled[best, rig][far] for rig in rigs), far)
    return (
        f"{scenario.name}: {nobody}{best} is settled {where} first, by {worst[best]:.3g} s, with {most} {name} at most."
    )


def _summary(config: BenchConfig, loop: BenchLoop, entries: Entries, metrics: Metrics) -> list[Table]:
    """A table of the loops and one a scenario, a line a controller."""
    worst = f"On {loop.first}, or where it says worst on {', '.join(loop.rigs)}; a dash: there is no such number"
    view = MetricView.of(loop.rig, loop.signal, loop.scenarios)
    loops = [_loop_line(loop, spec.name, entries, metrics) for spec in loop.controllers]
    note = (
        f"{worst}, as of an unstable loop. Margins: the worse of null and moving. Command noise: RMS at rest from "
        f"the declared sensors. {judged_words(config.conditions, loop.rig)}"
    )
    tables = [view.table("Loops", loops, loops[0], note, list(loops[0]))]
    for scenario in loop.scenarios:
        lines = [_scenario_line(loop, scenario, spec.name, entries, metrics) for spec in loop.controllers]
        note = (
            f"{worst}, as of a loop that never settles. The limit: the soonest that an optimiser settles the nominal "
            "rig, or the least error of a reference that is known ahead (jackbench limit). Energy: what the main lands "
            "take beyond their leakage at rest."
        )
        tables.append(view.table(scenario.name, lines, lines[0], note, list(lines[0])))
    return tables


def _scenario_line(
    loop: BenchLoop, scenario: Scenario, name: str, entries: Entries, metrics: Metrics
) -> dict[str, Any]:
    first, i = entries[name, loop.first], loop.scenarios.index(scenario)
    row, line = first["rows"][i], {"controller": name}
    over = next(s for s in metrics["spread"] if (s["controller"], s["scenario"]) == (name, scenario.name))
    if scenario.arrives is not None:
        far = excursion(scenario)
        slowest = None if over["unsettled"] else over["settling_s_most"]
        line |= {"settling_s": row["settling_s"], "settling_worst_s": slowest}
        line |= {far: row[far], f"{far}_worst": over[f"{far}_most"]}
    line |= {} if scenario.is_step else {"rms_error": row["rms_error"]}
    return line | {key: row[key] for key in ("times_limit", "iae")} | {"energy_j": first["energy"][i]["beyond_rest_j"]}


def _loop_line(loop: BenchLoop, name: str, entries: Entries, metrics: Metrics) -> dict[str, Any]:
    first, timing = entries[name, loop.first], metrics["timing"][name]
    worst = [entries[name, rig]["rows"][0]["ms"] for rig in loop.rigs]
    rms, size = first["noise"]["command_rms"], first["stiffness"]
    return {
        "controller": name,
        "ms": first["rows"][0]["ms"],
        "ms_worst": None if None in worst else max(worst),
        "gain_margin_db": first["rows"][0]["gain_margin_db"],
        "margins": first["rows"][0]["margins"],
        "dynamic_stiffness_least": None if size is None else float(min(size)),
        "command_rms": rms,
        **{key: timing[key] for key in ("solve_p50_us", "solve_p99_us")},
    }


def _fallbacks(loop: BenchLoop, metrics: Metrics) -> list[Table]:
    """How often a solver did not arrive."""
    names = {controller.name for controller in loop.controllers}
    keys = ["controller", "rig", "scenario", "samples", "fallbacks"]
    rows = [[row[key] for key in keys] for row in metrics["fallbacks"] if row["controller"] in names]
    note = "Samples in which a controller's solver did not arrive; its description says what it does then."
    return [Table("Fallbacks", keys, rows, note=note)] if rows else []


def _every(loop: BenchLoop, metrics: Metrics) -> list[Table]:
    """Every row of metrics.json of this loop."""
    names = {controller.name for controller in loop.controllers}
    rows = [row for row in metrics["rows"] if row["controller"] in names]
    maker = MetricView.of(loop.rig, loop.signal, loop.scenarios)
    motion = (
        "settling_s",
        "times_limit",
        "overshoot_percent",
        "rise_s",
        "iae",
        "rms_error",
        "peak_command",
        "saturated_s",
        "cavitation_s",
    )
    motion += ("residual_oscillation", "band", "peak_deviation", "tripped")
    note = " ".join(("The rows of metrics.json.", *(line for each in loop.scenarios for line in each.remarks)))
    note += gas_words(rows)
    whose = ("scenario", "rig", "controller")
    worse = "The worse of null and moving."
    return [
        maker.table("Motion of every controller on every rig", rows, (*whose, *motion), note),
        maker.table("Margins of every controller on every rig", rows, (*whose, *MARGINS), worse),
    ]
