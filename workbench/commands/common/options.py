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
from ...base.units import Spec, quantity
from .outcome import Outcome, Progress, Stage, leave, no_checkpoint

if TYPE_CHECKING:
    from ...base.process_pool import Jobs
    from .run_folder import RunFolder

Study = Callable[[Stage, Progress], Outcome]
FolderStudy = Callable[["RunFolder", Progress], Outcome]
Call = Callable[[argparse.Namespace, list[str]], None]

_PORTS = 65535  # the highest


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


class _Checked(argparse.Action):
    """Keeps what is read of an option; where that is refused, the line says the option."""

    def __init__(self, *, read: Callable[[Any], float], **words: Any) -> None:
        super().__init__(**words)
        self._read = read

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option_string: Any = None
    ) -> None:
        """Raises InputError."""
        try:
            setattr(namespace, self.dest, self._read(values))
        except InputError as error:
            raise InputError(f"{self.option_strings[0]} {values}: {error}") from None


def bounded(
    command: argparse.ArgumentParser,
    option: str,
    least: float,
    what: str,
    most: float = float("inf"),
    kind: Callable[[str], float] = int,
    metavar: str = "N",
    **words: Any,
) -> None:
    """An option that is a number from `least` to `most`, a whole one unless `kind` is float."""

    def read(number: float) -> float:
        if not least <= number <= most:
            raise InputError(f"must be {least:g} or more" + (f", {most:g} at most" if most < float("inf") else ""))
        return number

    command.add_argument(option, action=_Checked, read=read, type=kind, metavar=metavar, help=what, **words)


def measured(command: argparse.ArgumentParser, option: str, spec: Spec, what: str, metavar: str) -> None:
    """An option that is a number with its unit, within the bounds of a spec [SI]; None without it."""

    def read(text: str) -> float:
        number = quantity(text, spec.unit)
        if problem := spec.problem(number):
            raise InputError(problem)
        return number

    command.add_argument(option, action=_Checked, read=read, metavar=metavar, help=what)


def works(command: argparse.ArgumentParser, cluster: bool = True) -> None:
    """The options of a command whose stages several processes share, those of a cluster too where `cluster`."""
    bounded(command, "--jobs", 1, "worker processes (default: one per core)")
    if cluster:
        what = "scheduler of a Dask cluster whose workers do the work, such as tcp://192.168.0.7:8786"
        command.add_argument("--cluster", metavar="ADDRESS", help=what)


def processes(options: argparse.Namespace) -> int:
    """How many processes of this machine share the stages."""
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


def on_port(command: argparse.ArgumentParser, option: str, what: str) -> None:
    """The option of a port, 0 for a free one."""
    bounded(command, option, 0, f"{what} (default: a free one)", most=_PORTS, default=0)


def on_opc_ua(command: argparse.ArgumentParser) -> None:
    """The option of a command that a SCADA panel may look on."""
    bounded(command, "--opcua", 1, "port of the OPC UA server for a SCADA panel", most=_PORTS)


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
