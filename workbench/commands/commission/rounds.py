"""A round of a commissioning: what the records say, a controller for the rig as found, and what it does on the rig."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from ...base.trust import allow
from ...control.controller_spec import ControllerSpec
from ...link.client import LinkClient
from ...link.commissioning.designs import exactly, searched_designs
from ...link.commissioning.rig_time import TRACES, Computing
from ...link.commissioning.verify import foretold
from ...link.course import wire_rig
from ...loop.rig_variations import Conditions
from ...loop.rows import judge, linear_loops, loop_setup
from ...loop.scenarios import Scenario
from ...records import Record, load_campaign
from ...records.excitation import Excitation, read_excitation
from ...rigs.rig import Rig
from ..common.outcome import Progress, Stage
from ..common.run_folder import RunFolder
from ..common.wire_campaign import wire_campaign
from ..plan.study import run_plan
from ..trace.study import trace_campaign
from ..trace.words import verdict

if TYPE_CHECKING:
    from ..trace.answer import TraceAnswer

T = TypeVar("T")
TRANSDUCERS = Path(__file__).with_name("transducers.py")
WORTH = 0.1  # of the settling, that knowing the numbers must save to ask for more records
_FURTHER = 2  # records that a plan gives


@dataclass(frozen=True)
class Found:
    """What a round's records say, the rig as found, its controller, and the one that exact numbers would give."""

    answer: "TraceAnswer"
    rig: Rig
    spec: ControllerSpec
    known: ControllerSpec

    @property
    def explains(self) -> bool:
        """Whether the records are those of the rig as found, if not to the last of the noise."""
        return self.answer.verdict in ("named", "incomplete", "none")

    def exact(self, scenario: Scenario, client: LinkClient) -> float | None:
        """What a scenario would settle in [s] were the rig's numbers known exactly, in simulation with noise."""
        setup = loop_setup(wire_rig(exactly(self.rig), client))
        _, row = judge(self.known, scenario, setup, linear_loops(self.known, setup), Conditions().noise)
        settling: float | None = row["settling_s"]
        return settling


def again(predicted: float | None, measured: float | None, exact: float | None) -> str:
    """Why the records do not suffice, of the goal's settling [s] as it was played: predicted, measured on the rig, and
    with exact numbers; empty where they do."""
    if measured is None:
        return "the goal does not settle on the rig"
    if predicted is None or not foretold(predicted, measured):
        told = "not to settle" if predicted is None else f"{predicted:.3g} s"
        return f"predicted {told}, measured {measured:.3g} s"
    if exact is not None and exact < (1 - WORTH) * predicted:
        return f"with exact numbers {exact:.3g} s would be in reach, not {predicted:.3g} s"
    return ""


@dataclass(frozen=True)
class Searches:
    """What searches of controllers need: the first guess, the goal, who computes, and how long."""

    start: ControllerSpec
    goal: str
    jobs: int
    run: RunFolder
    say: Progress
    computing: Computing

    def designs(self, rig: Rig, name: str) -> list[ControllerSpec]:
        """The leading designs for a rig within what is uncertain of it, best first."""
        stage = named_stage(self.run, name)
        specs, missed = searched_designs(rig, self.start, name, self.goal, stage, _few(self.say), self.jobs)
        if missed:
            self.say(f"no design meets every goal on the {name} rig: {missed}")
        return specs


Decide = Callable[[Rig, Sequence[ControllerSpec]], ControllerSpec]  # on one of the designs for a rig


def found_by(folder: Path, searches: Searches, number: int, declared: Rig, decide: Decide) -> Found:
    """What the campaign in a folder says of a rig as it was `declared`, and the controller for it."""
    run, say = searches.run, searches.say
    say("asks what the records say that the datasheet does not")
    allow(TRANSDUCERS)
    stage = named_stage(run, f"trace-{number}")
    over = searches.computing.over(TRACES[number - 1], f"the trace of round {number}")
    answer = trace_campaign(
        folder, effects=[TRANSDUCERS], stage=stage, progress=say, jobs=searches.jobs, learns=False, over=over
    )
    say(sentence(answer))
    rig = replace(answer.rig, name=f"{declared.name}-found", further_limits=declared.further_limits)
    say("searches a controller for the rig as it was found")
    spec = decide(rig, searches.designs(rig, f"found-{number}"))
    say("searches what exact numbers would bring")
    return Found(answer, rig, spec.named("found"), searches.designs(exactly(rig), f"exact-{number}")[0])


def sentence(answer: "TraceAnswer") -> str:
    """What the records say, without the report that would draw it and simulate what to record next."""
    return verdict(answer.trace, None, None, {})


def campaign_in(
    folder: Path, rig: Rig, client: LinkClient, rest: Record, records: Mapping[str, Record], heldout: Sequence[str]
) -> Path:
    """Leave records as a campaign folder."""
    folder.mkdir(exist_ok=True)
    for name, text in wire_campaign(rig, client, rest, records, heldout).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def further(folder: Path, rig: Rig, found: Found, run: RunFolder, say: Progress) -> list[Excitation]:
    """What is to be recorded next, for what the records in a folder do not tell: of the rig as found where an effect
    has a name, else of the datasheet's."""
    say("plans records of what is not known yet")
    model = found.rig if found.explains else rig
    outcome = run_plan(load_campaign(folder), model, named_stage(run, "plan"), say)
    waves = []
    for row in outcome.metrics["records"][:_FURTHER]:
        path = folder / f"planned-{row['file']}"
        text = outcome.files[row["file"]]
        assert isinstance(text, str)
        path.write_text(text, encoding="utf-8")
        waves.append(read_excitation(path, rig.period.value, rig.middle))
    return waves


def named_stage(run: RunFolder, search: str) -> Stage:
    """Stages of one of several parts."""

    def stage(name: str, compute: Callable[[], T]) -> T:
        return run.stage(f"{search}-{name}", compute)

    return stage


def _few(progress: Progress) -> Progress:
    """Progress that tells every fiftieth trial of a search."""
    return lambda text: (
        progress(text) if not text.startswith("trial ") or text.split()[1].endswith(("00", "50")) else None
    )
