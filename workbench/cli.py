"""The command line: reads arguments, calls a study, leaves a run folder. No logic of its own."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from . import catalogue, designing, studies, tracing
from .bench_config import load_bench
from .command import Parser, computes, finish, jobs, prints, works
from .config import load_config
from .datasheet import load_datasheet
from .errors import InputError
from .rig import load_rig, rig_table, rig_text
from .runs import versions
from .studies import bench, compare, excite, finished, frequency, new_rig, record, residual, speed
from .studies.outcome import Outcome, Progress, Stage


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Status 0: done; 2: bad input, with one line on stderr; 130: interrupted, resumable."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # where an experiment's own controllers are looked for
    try:
        options = _parser().parse_args(words)
        options.call(options, words)
    except InputError as error:
        print(f"jackbench: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # the reader of our output has seen enough, as in `jackbench list effects | head`
        sys.stderr.close()
        return 0
    except KeyboardInterrupt:
        print("jackbench: interrupted; the same command resumes", file=sys.stderr)
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="jackbench", description="Controller-design workbench for servo-hydraulic jacks.")
    parser.add_argument("--version", action="version", version=f"jackbench {versions()['jackbench']}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=Parser)
    run = commands.add_parser("run", help="run an experiment file", description="Run an experiment file.")
    run.add_argument("experiment", help="such as experiments/paper.toml")
    computes(run, _run)
    benched = commands.add_parser(
        "bench",
        help="controllers on a set of rigs in scenarios",
        description="Play every controller on every rig of a set in every scenario, and hold them against each other.",
    )
    benched.add_argument("experiment", help="such as experiments/benchmark.toml")
    works(benched)
    computes(benched, _bench)
    found = commands.add_parser(
        "residual",
        help="hold a rig's model against recordings",
        description="Compare a rig's model with the held-out records of a campaign folder.",
    )
    found.add_argument("campaign", help="folder with a campaign.toml")
    found.add_argument("--free-run", action="store_true", help="add the error of one run through each whole record")
    computes(found, _residual)
    tracing.add(commands)
    designing.add(commands)
    _recording_commands(commands)
    compared = commands.add_parser(
        "compare", help="hold finished runs against each other", description="Overlay finished runs, with a table."
    )
    compared.add_argument("folders", nargs="+", metavar="DIR", help="folder that a command left")
    computes(compared, _compare, rig=False)
    built = commands.add_parser("new-rig", help="build a rig from a datasheet", description="Build a rig file.")
    built.add_argument("datasheet", help="such as experiments/new_rig.toml")
    computes(built, _new_rig, rig=False)
    listed = commands.add_parser("list", help="list what there is", description="List what there is.")
    listed.add_argument("kind", metavar="|".join(catalogue.KINDS))
    prints(listed, _list)
    timed = commands.add_parser("speed", help="time the engine beside public solvers", description="Time the engine.")
    computes(timed, _speed)
    shown = commands.add_parser("show", help="show a rig and what follows from its numbers", description="Show a rig.")
    shown.add_argument("rig", help="a bundled rig or a rig file")
    prints(shown, _show)
    return parser


def _recording_commands(commands: Any) -> None:
    """Commands about measured frequency responses, and about what a rig is made to do for a recording."""
    measured = commands.add_parser(
        "frequency",
        help="measured frequency response of a pair of signals, beside the model's",
        description="Frequency response of a pair of signals: of a campaign's held-out records, or of a sheet.",
    )
    measured.add_argument("source", help="folder with a campaign.toml, or a sheet: frequency, gain, phase")
    measured.add_argument("--input", default="command", help="signal (default: command)")
    measured.add_argument("--output", required=True, help="signal, such as spool")
    measured.add_argument("--record", action="append", default=[], help="a record by name, instead of those held out")
    measured.add_argument("--period", type=float, help="length of one period [s], where it is not found by itself")
    measured.add_argument("--amplitude", type=float, help="of a sheet, in the unit of its input: 1, mA, mm")
    computes(measured, _frequency)
    logged = commands.add_parser("record", help="record a rig in simulation", description="Leave a campaign folder.")
    logged.add_argument("rig", help="a bundled rig or a rig file, with [[effects]] or without")
    logged.add_argument(
        "--play", type=Path, nargs="+", default=[], metavar="FILE", help="excitations; the last is held out"
    )
    logged.add_argument("--seed", type=int, default=0, help="of the sensor noise (default: 0)")
    computes(logged, _record, rig=False)
    designed = commands.add_parser(
        "excite", help="design an excitation that a rig can play", description="Write an excitation for a rig to play."
    )
    designed.add_argument("rig", help="a bundled rig or a rig file: its control period and its limits")
    designed.add_argument("kind", choices=excite.KINDS)
    designed.add_argument("--signal", choices=("command", "reference"), default="command")
    designed.add_argument("--amplitude", type=float, required=True, help="peak: command [1] or reference [mm]")
    designed.add_argument("--seconds", type=float, required=True, help="length of one period")
    designed.add_argument("--repeat", type=int, default=1, help="periods (default: 1)")
    designed.add_argument("--band", type=float, nargs=2, metavar="HZ", help="of a chirp or multisine")
    designed.add_argument("--lines", type=int, help="of a multisine, about (default: every harmonic)")
    designed.add_argument("--spectrum", choices=("flat", "1/f"), default="flat", help="of a multisine")
    designed.add_argument("--sweep", choices=("log", "linear"), default="log", help="of a chirp")
    designed.add_argument("--out", type=Path, required=True, metavar="FILE", help="a .csv file")
    designed.add_argument("--force", action="store_true", help="replace an existing file")
    designed.set_defaults(call=_excite)


def _run(options: argparse.Namespace, words: list[str]) -> None:
    config = load_config(options.experiment, options.rig)
    identity = {"command": "run", "experiment": config.source, "rig": rig_table(config.rig)}
    finish(options, words, Path(options.experiment).stem, identity, studies.study_of(config))


def _bench(options: argparse.Namespace, words: list[str]) -> None:
    config = load_bench(options.experiment, options.rig)
    identity = {"command": "bench", "experiment": config.source, "rig": rig_table(config.rig)}
    finish(
        options, words, Path(options.experiment).stem, identity, partial(bench.run_bench, config, jobs=jobs(options))
    )


def _residual(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    identity = {"command": "residual", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity["free_run"] = options.free_run
    name = f"residual-{campaign.path.resolve().name}"
    study = partial(residual.run_residual, campaign, rig, free_run=options.free_run)
    finish(options, words, name, identity, study)


def _frequency(options: argparse.Namespace, words: list[str]) -> None:
    pair = (options.input, options.output)
    task = frequency.load(options.source, pair, options.rig, options.record, options.period, options.amplitude)
    identity = {"command": "frequency", "rig": rig_table(task.rig), **frequency.identity(task)}
    name = "-".join(["frequency", task.source, *pair])
    finish(options, words, name, identity, partial(frequency.run_frequency, task))


def _record(options: argparse.Namespace, words: list[str]) -> None:
    plan = record.plan(options.rig, options.play, options.seed)
    identity = {"command": "record", "rig": rig_table(plan.rig), **record.identity(plan)}
    finish(options, words, f"record-{plan.rig.name}", identity, partial(record.run_record, plan))


def _excite(options: argparse.Namespace, _words: list[str]) -> None:
    band = tuple(options.band) if options.band else None
    shape = (options.repeat, band, options.lines, options.spectrum, options.sweep)
    design = excite.Design(options.kind, options.signal, options.amplitude, options.seconds, *shape)
    print(excite.excite(design, load_rig(options.rig), options.out, options.force))


def _compare(options: argparse.Namespace, words: list[str]) -> None:
    runs = finished.load(options.folders)
    identity = {"command": "compare", "runs": finished.fingerprint(runs)}
    name = "-".join(["compare", *(run.name.replace("/", "-") for run in runs)])
    finish(options, words, name, identity, lambda _stage, _say: compare.run_compare(runs))


def _new_rig(options: argparse.Namespace, words: list[str]) -> None:
    sheet = load_datasheet(options.datasheet)

    def study(stage: Stage, say: Progress) -> Outcome:
        outcome, rig = new_rig.run_new_rig(sheet, stage, say)
        return replace(outcome, files={"rig.toml": rig_text(rig)})

    finish(options, words, Path(options.datasheet).stem, {"command": "new-rig", **new_rig.identity(sheet)}, study)


def _speed(options: argparse.Namespace, words: list[str]) -> None:
    rig = load_rig(options.rig or "jack-10t")
    finish(options, words, "speed", {"command": "speed", "rig": rig_table(rig)}, partial(speed.run_speed, rig))


def _list(options: argparse.Namespace, _words: list[str]) -> None:
    rows = catalogue.listing(options.kind)
    print(json.dumps(rows, indent=2) if options.json else catalogue.listing_text(rows))


def _show(options: argparse.Namespace, _words: list[str]) -> None:
    table = catalogue.describe(load_rig(options.rig))
    print(json.dumps(table, indent=2) if options.json else catalogue.describe_text(table))


if __name__ == "__main__":
    sys.exit(main())
