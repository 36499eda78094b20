"""What every command of the command line shares: options, and a study that leaves a run folder."""

import argparse
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.cores import cores
from ...base.errors import InputError
from ...base.files import check_place
from .outcome import Outcome, Progress, Stage, leave, no_checkpoint

if TYPE_CHECKING:
    from ...base.process_pool import Jobs
    from .run_folder import RunFolder

Study = Callable[[Stage, Progress], Outcome]
FolderStudy = Callable[["RunFolder", Progress], Outcome]
Call = Callable[[argparse.Namespace, list[str]], None]


def prints(command: argparse.ArgumentParser, call: Call) -> None:
    """Options of a command that prints."""
    command.add_argument("--json", action="store_true", help="print JSON, for scripts")
    command.set_defaults(call=call)


def computes(command: argparse.ArgumentParser, call: Call, rig: bool = True) -> None:
    """Options of a command that leaves a run folder."""
    if rig:
        command.add_argument("--rig", help="a bundled rig or a rig file, instead of the one that the input names")
    command.add_argument("--out", type=Path, help="folder to leave the results in (default: out/NAME)")
    command.add_argument("--picture", type=Path, help="also draw the report's main figure into this .png or .svg file")
    command.add_argument("--force", action="store_true", help="replace an existing folder")
    command.set_defaults(call=call)


def draws(command: argparse.ArgumentParser, what: str = "number of plants to draw (default: the experiment's)") -> None:
    """The option of a command that draws plants."""
    command.add_argument("--plants", type=int, metavar="N", help=what)


def plants(options: argparse.Namespace) -> int | None:
    """How many plants to draw, None as the experiment says. Raises InputError."""
    if options.plants is not None and options.plants < 1:
        raise InputError(f"--plants {options.plants}: must be 1 or more")
    return options.plants


def works(command: argparse.ArgumentParser, cluster: bool = True) -> None:
    """The options of a command whose stages several processes share, those of a cluster too where `cluster`."""
    command.add_argument("--jobs", type=int, metavar="N", help="worker processes (default: one per core)")
    if cluster:
        what = "scheduler of a Dask cluster whose workers do the work, such as tcp://192.168.0.7:8786"
        command.add_argument("--cluster", metavar="ADDRESS", help=what)


def processes(options: argparse.Namespace) -> int:
    """How many processes of this machine share the stages. Raises InputError."""
    if options.jobs is not None and options.jobs < 1:
        raise InputError(f"--jobs {options.jobs}: must be 1 or more")
    return options.jobs or cores()


def jobs(options: argparse.Namespace) -> "Jobs":
    """How many processes share the stages, or the cluster whose workers do. Raises InputError."""
    if options.cluster is None:
        return processes(options)
    if options.jobs is not None:
        raise InputError("--jobs is for this machine, --cluster for others; leave one of them out")
    from ...base.cluster import cluster_at

    return cluster_at(options.cluster)


def on_link(command: argparse.ArgumentParser, required: bool) -> None:
    """The options that say where a live rig is."""
    command.add_argument("--at", required=required, metavar="udp://HOST:PORT", help="address of the live rig")
    command.add_argument("--token", default="", help="the token that the rig asks for")


_OUTCOMES: ContextVar[list[Outcome] | None] = ContextVar("outcomes", default=None)


@contextmanager
def no_folder() -> Iterator[list[Outcome]]:
    """Within, commands leave folders only where they are asked for files; the outcomes of those that computed."""
    outcomes = list[Outcome]()
    token = _OUTCOMES.set(outcomes)
    try:
        yield outcomes
    finally:
        _OUTCOMES.reset(token)


def finish(options: argparse.Namespace, words: list[str], name: str, identity: dict[str, Any], study: Study) -> Outcome:
    """Compute in DIR.partial, then rename it."""
    outcomes, files = _OUTCOMES.get(), (getattr(options, place, None) for place in ("out", "picture", "pdf"))
    if outcomes is not None and not any(files):
        outcomes.append(study(no_checkpoint, lambda _: None))
        return outcomes[-1]
    return finish_in_folder(options, words, name, identity, lambda run, progress: study(run.stage, progress))


def finish_in_folder(
    options: argparse.Namespace, words: list[str], name: str, identity: dict[str, Any], study: FolderStudy
) -> Outcome:
    """Compute as `finish` does, by a study that writes files of its own into the open run's folder."""
    from .run_folder import open_run
    from .run_index import write_index

    out = options.out or Path("out") / name
    _check_picture(options.picture)
    began = time.perf_counter()

    def progress(what: str) -> None:
        with suppress(OSError):  # of a terminal or a pipe that is closed: what is computed is worth more than its line
            print(f"{time.perf_counter() - began:7.1f} s  {what}", file=sys.stderr, flush=True)

    with open_run(out, identity, options.force) as run:
        outcome = study(run, progress)
        page = leave(run, outcome, identity, shlex.join(words))
    if (outcomes := _OUTCOMES.get()) is not None:
        outcomes.append(outcome)
    index = write_index(out.resolve().parent)
    if options.picture and outcome.drawing.picture:
        from ...report import page_looks
        from ...report.still import still_picture

        still_picture(outcome.drawing.picture, options.picture, page_looks(page))
    print(page.verdict)
    print(f"report: {out / 'report.html'}")
    if index:
        print(f"all runs: {out.parent / index.name}")
    return outcome


def _check_picture(path: Path | None) -> None:
    if path is None:
        return
    if path.suffix not in (".png", ".svg"):
        raise InputError(f"--picture {path}: name a .png or an .svg file")
    check_place(path, "--picture")
