"""The command line: reads arguments, calls a study, leaves a run folder. No logic of its own."""

import argparse
import json
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from . import catalogue, studies
from .config import load_config
from .datasheet import load_datasheet
from .errors import InputError
from .records import Campaign
from .report import page_looks
from .rig import load_rig, rig_table, rig_text
from .runs import open_run, resolved_config, versions
from .studies import compare, excite, finished, fit, frequency, new_rig, record, residual, speed, trace
from .studies.outcome import Outcome, Progress, Stage

Study = Callable[[Stage, Progress], Outcome]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Status 0: done; 2: bad input, with one line on stderr; 130: interrupted, resumable."""
    words = sys.argv[1:] if arguments is None else list(arguments)
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


class _Parser(argparse.ArgumentParser):
    """Complains in one line."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="jackbench", description="Controller-design workbench for servo-hydraulic jacks.")
    parser.add_argument("--version", action="version", version=f"jackbench {versions()['jackbench']}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND", parser_class=_Parser)
    run = commands.add_parser("run", help="run an experiment file", description="Run an experiment file.")
    run.add_argument("experiment", help="such as experiments/paper.toml")
    _computes(run, _run)
    found = commands.add_parser(
        "residual",
        help="hold a rig's model against recordings",
        description="Compare a rig's model with the held-out records of a campaign folder.",
    )
    found.add_argument("campaign", help="folder with a campaign.toml")
    found.add_argument("--free-run", action="store_true", help="add the error of one run through each whole record")
    _computes(found, _residual)
    _tracing_commands(commands)
    _recording_commands(commands)
    compared = commands.add_parser(
        "compare", help="hold finished runs against each other", description="Overlay finished runs, with a table."
    )
    compared.add_argument("folders", nargs="+", metavar="DIR", help="folder that a command left")
    _computes(compared, _compare, rig=False)
    built = commands.add_parser("new-rig", help="build a rig from a datasheet", description="Build a rig file.")
    built.add_argument("datasheet", help="such as experiments/new_rig.toml")
    _computes(built, _new_rig, rig=False)
    listed = commands.add_parser("list", help="list what there is", description="List what there is.")
    listed.add_argument("kind", metavar="|".join(catalogue.KINDS))
    _prints(listed, _list)
    timed = commands.add_parser("speed", help="time the engine beside public solvers", description="Time the engine.")
    _computes(timed, _speed)
    shown = commands.add_parser("show", help="show a rig and what follows from its numbers", description="Show a rig.")
    shown.add_argument("rig", help="a bundled rig or a rig file")
    _prints(shown, _show)
    return parser


def _tracing_commands(commands: Any) -> None:
    """Commands that fit a rig to recordings, and ask what it lacks."""
    fitted = commands.add_parser(
        "fit", help="fit a rig's numbers to recordings", description="Fit the numbers of a rig that have bounds."
    )
    fitted.add_argument("campaign", help="folder with a campaign.toml")
    fitted.add_argument("--starts", type=int, default=fit.STARTS, help=f"places to start from (default: {fit.STARTS})")
    _leaves_rig(fitted, _fit)
    traced = commands.add_parser(
        "trace", help="why do model and rig disagree", description="Trace the residual to what the model lacks."
    )
    traced.add_argument("campaign", help="folder with a campaign.toml")
    traced.add_argument("--effects", type=Path, nargs="+", default=[], metavar="FILE.py", help="effects of your own")
    traced.add_argument("--without", nargs="+", default=[], metavar="NAME", help="effects that are not to be tried")
    _leaves_rig(traced, _trace)


def _leaves_rig(command: argparse.ArgumentParser, call: Callable[[argparse.Namespace, list[str]], None]) -> None:
    command.add_argument("--rig-out", type=Path, metavar="FILE", help="also write the rig as found, a .toml file")
    _computes(command, call)


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
    _computes(measured, _frequency)
    logged = commands.add_parser("record", help="record a rig in simulation", description="Leave a campaign folder.")
    logged.add_argument("rig", help="a bundled rig or a rig file, with [[effects]] or without")
    logged.add_argument(
        "--play", type=Path, nargs="+", default=[], metavar="FILE", help="excitations; the last is held out"
    )
    logged.add_argument("--seed", type=int, default=0, help="of the sensor noise (default: 0)")
    _computes(logged, _record, rig=False)
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


def _prints(command: argparse.ArgumentParser, call: Callable[[argparse.Namespace, list[str]], None]) -> None:
    command.add_argument("--json", action="store_true", help="print JSON, for scripts")
    command.set_defaults(call=call)


def _computes(
    command: argparse.ArgumentParser, call: Callable[[argparse.Namespace, list[str]], None], rig: bool = True
) -> None:
    if rig:
        command.add_argument("--rig", help="a bundled rig or a rig file, instead of the one that is named")
    command.add_argument("--out", type=Path, help="folder to leave the results in (default: out/NAME)")
    command.add_argument("--picture", type=Path, help="also draw the report's telling figure into a .png or .svg file")
    command.add_argument("--force", action="store_true", help="replace an existing folder")
    command.set_defaults(call=call)


def _run(options: argparse.Namespace, words: list[str]) -> None:
    config = load_config(options.experiment, options.rig)
    identity = {"command": "run", "experiment": config.source, "rig": rig_table(config.rig)}
    _finish(options, words, Path(options.experiment).stem, identity, studies.study_of(config))


def _residual(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    identity = {"command": "residual", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity["free_run"] = options.free_run
    name = f"residual-{campaign.path.resolve().name}"
    study = partial(residual.run_residual, campaign, rig, free_run=options.free_run)
    _finish(options, words, name, identity, study)


def _fit(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    identity = {"command": "fit", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity["starts"] = options.starts
    _finish_with_rig(options, words, campaign, identity, partial(fit.run_fit, campaign, rig, options.starts))


def _trace(options: argparse.Namespace, words: list[str]) -> None:
    campaign, rig = residual.load(options.campaign, options.rig)
    files = [str(file.resolve()) for file in options.effects]
    library = trace.effects_for(rig, files, options.without)
    identity = {"command": "trace", "campaign": residual.fingerprint(campaign), "rig": rig_table(rig)}
    identity |= {"effects": trace.digest((*rig.effect_files, *files)), "without": sorted(options.without)}
    study = partial(trace.run_trace, campaign, rig, library, files=files)
    _finish_with_rig(options, words, campaign, identity, study)


def _finish_with_rig(
    options: argparse.Namespace, words: list[str], campaign: Campaign, identity: dict[str, Any], study: Study
) -> None:
    """Finish a study that leaves a rig.toml, which --rig-out is a copy of."""
    out = options.rig_out
    if out is not None:
        if out.suffix != ".toml":
            raise InputError(f"--rig-out {out}: name a .toml file")
        _check_place(out, "--rig-out")
        if out.exists() and not options.force:
            raise InputError(f"--rig-out {out}: exists already; choose another or add --force to replace it")
    outcome = _finish(options, words, f"{identity['command']}-{campaign.path.resolve().name}", identity, study)
    if out is not None:
        out.write_text(outcome.files["rig.toml"], encoding="utf-8")


def _frequency(options: argparse.Namespace, words: list[str]) -> None:
    pair = (options.input, options.output)
    task = frequency.load(options.source, pair, options.rig, options.record, options.period, options.amplitude)
    identity = {"command": "frequency", "rig": rig_table(task.rig), **frequency.identity(task)}
    name = "-".join(["frequency", task.source, *pair])
    _finish(options, words, name, identity, partial(frequency.run_frequency, task))


def _record(options: argparse.Namespace, words: list[str]) -> None:
    plan = record.plan(options.rig, options.play, options.seed)
    identity = {"command": "record", "rig": rig_table(plan.rig), **record.identity(plan)}
    _finish(options, words, f"record-{plan.rig.name}", identity, partial(record.run_record, plan))


def _excite(options: argparse.Namespace, _words: list[str]) -> None:
    band = tuple(options.band) if options.band else None
    shape = (options.repeat, band, options.lines, options.spectrum, options.sweep)
    design = excite.Design(options.kind, options.signal, options.amplitude, options.seconds, *shape)
    print(excite.excite(design, load_rig(options.rig), options.out, options.force))


def _compare(options: argparse.Namespace, words: list[str]) -> None:
    runs = finished.load(options.folders)
    identity = {"command": "compare", "runs": finished.fingerprint(runs)}
    name = "-".join(["compare", *(run.name.replace("/", "-") for run in runs)])
    _finish(options, words, name, identity, lambda _stage, _say: compare.run_compare(runs))


def _new_rig(options: argparse.Namespace, words: list[str]) -> None:
    sheet = load_datasheet(options.datasheet)

    def study(stage: Stage, say: Progress) -> Outcome:
        outcome, rig = new_rig.run_new_rig(sheet, stage, say)
        return replace(outcome, files={"rig.toml": rig_text(rig)})

    _finish(options, words, Path(options.datasheet).stem, {"command": "new-rig", **new_rig.identity(sheet)}, study)


def _speed(options: argparse.Namespace, words: list[str]) -> None:
    rig = load_rig(options.rig or "jack-10t")
    _finish(options, words, "speed", {"command": "speed", "rig": rig_table(rig)}, partial(speed.run_speed, rig))


def _list(options: argparse.Namespace, _words: list[str]) -> None:
    rows = catalogue.listing(options.kind)
    print(json.dumps(rows, indent=2) if options.json else catalogue.listing_text(rows))


def _show(options: argparse.Namespace, _words: list[str]) -> None:
    table = catalogue.describe(load_rig(options.rig))
    print(json.dumps(table, indent=2) if options.json else catalogue.describe_text(table))


def _finish(
    options: argparse.Namespace, words: list[str], name: str, identity: dict[str, Any], study: Study
) -> Outcome:
    """Compute in DIR.partial, then rename it."""
    out = options.out or Path("out") / name
    _check_picture(options.picture)
    began = time.perf_counter()

    def progress(what: str) -> None:
        print(f"{time.perf_counter() - began:7.1f} s  {what}", file=sys.stderr, flush=True)

    with open_run(out, identity, options.force) as run:
        outcome = study(run.stage, progress)
        footer = {"command": shlex.join(["jackbench", *words]), "versions": _versions(), **outcome.page.footer}
        page = replace(outcome.page, footer=footer)
        for file, text in outcome.files.items():
            (run.dir / file).write_text(text, encoding="utf-8")
        run.finish(outcome.metrics, resolved_config(identity), outcome.tables, page)
    if options.picture:
        from .report.still import still_picture  # matplotlib loads slowly, and most runs draw no picture

        still_picture(outcome.picture, options.picture, page_looks(page))
    print(outcome.page.verdict)
    print(f"report: {out / 'report.html'}")
    return outcome


def _check_picture(path: Path | None) -> None:
    if path is None:
        return
    if path.suffix not in (".png", ".svg"):
        raise InputError(f"--picture {path}: name a .png or an .svg file")
    _check_place(path, "--picture")


def _check_place(path: Path, option: str) -> None:
    if not path.parent.is_dir():
        raise InputError(f"{option} {path}: no folder {path.parent}; make it first")


def _versions() -> str:
    return ", ".join(f"{package} {number}" for package, number in versions().items())


if __name__ == "__main__":
    sys.exit(main())
