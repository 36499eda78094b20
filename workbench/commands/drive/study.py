"""Controllers of an experiment at a live rig: its scenarios played, judged as `run` judges them, and recorded."""

from _thread import interrupt_main
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.errors import InputError, LinkLost
from ...control.controller_spec import ControllerSpec
from ...control.export.program import identifier
from ...link.client import LinkClient
from ...link.commissioning.allowed import allowed
from ...link.course import Judged, PlayedCourse, judge_played, play_course, rest_record, wire_rig
from ...link.joined import joined
from ...link.opc_ua import opc_ua_server, supervised_loop
from ...link.wire_loop import INTERRUPTED, check
from ...loop.rows import LinearLoops, LoopSetup, judge, linear_loops, loop_setup
from ...loop.sampled_loop import LoopRun
from ...loop.scenarios import Scenario
from ...records import Record
from ..common.design_numbers import Subject
from ..common.limits_told import limits_json
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig
from ..common.wire_campaign import wire_campaign
from .page import drive_page

_Course = tuple[ControllerSpec, Scenario, PlayedCourse]


def run_drive(config: StepConfig, at: str, token: str, opc_ua: int | None, stage: Stage, progress: Progress) -> Outcome:
    """`rows` as of `run`, measured at the rig; `predicted`, the same of the experiment's rig in simulation; `late`
    readings; `ended`, why playing stopped before its end, or None; `trips`; `limits`, and whose each is; `left_out`,
    scenarios that need more than a command, and `refused`, what is foreseen beyond a limit. Raises InputError where
    that leaves nothing to play.
    """
    if not any(map(_only_command, config.scenarios)):
        raise InputError("every scenario has a load or a far end that moves, and a command plays neither; add a step")
    with LinkClient(at, token) as client, _looked_on(client, opc_ua, progress):
        progress(f"{client.hello.rig} at {at}, {'lockstep' if client.hello.lockstep else 'real time'}")
        config = replace(config, rig=joined(config.rig, client.hello))
        for spec in config.controllers:
            check(client, config.rig, spec.build(config.rig.period.value))
        static = rest_record(client, config.rig)
        setup = loop_setup(wire_rig(config.rig, client))
        loops = {spec.name: linear_loops(spec, setup) for spec in config.controllers}
        told, refused = _foretold(config, setup, loops, _home(config, static), progress)
        played = list[_Course]()
        ended = _play(config, told, client, played, progress)
        name = client.hello.rig
    judged = list[Judged]()
    try:
        for spec, scenario, each in played:
            before = told[spec.name, scenario.name].told
            judged.append(judge_played(before, spec, scenario, each, setup, loops[spec.name]))
    except KeyboardInterrupt:  # what was recorded is left in any case
        ended = INTERRUPTED
    trips = [each.trip for *_, each in played if each.trip]
    metrics = {
        "rig": name,
        "rows": [{**each.row, "rig": name} for each in judged],
        "predicted": [each.prediction for each in judged],
        "late": sum(each.run.late for *_, each in played),
        "ended": ended,
        "trips": len(trips),
        "tripped": [trip.table() for trip in trips],
        "limits": limits_json(config.rig),
        "refused": refused,
        "left_out": [scenario.name for scenario in config.scenarios if not _only_command(scenario)],
    }
    records = _records(played)
    heldout = list(records)[-2:-1] if len(records) > 1 else list(records)
    files = wire_campaign(config.rig, client, static, records, heldout)
    tables = {
        f"step-{each.controller}-{each.scenario.name}": {
            "t [s]": each.measured.record.t,
            "demanded [1]": each.measured.demanded,
            **each.measured.record.signals,
        }
        for each in judged
    }
    subject = Subject(config.rig, config.controllers)
    return Outcome(metrics, lambda: drive_page(config, metrics, judged), tables, files, subject)


@dataclass(frozen=True)
class _Foretold:
    """A controller in a scenario, from where [SI] it starts: the run and the row in simulation."""

    spec: ControllerSpec
    scenario: Scenario
    start: float
    told: tuple[LoopRun, dict[str, Any]]


def _foretold(
    config: StepConfig, setup: LoopSetup, loops: Mapping[str, LinearLoops], home: float, progress: Progress
) -> tuple[dict[tuple[str, str], _Foretold], list[dict[str, str]]]:
    """Every controller in every scenario that a command alone can play, in simulation from where it starts; and those
    that do not stay clear of the limits on every plant within the rig's bounds, with the reason. Raises InputError
    where none does."""
    told, refused, rig = dict[tuple[str, str], _Foretold](), list[dict[str, str]](), setup.rig
    plants, period = allowed(rig), rig.period.value
    for spec in config.controllers:
        for scenario in filter(_only_command, config.scenarios):
            progress(f"foresees {spec.name}: {scenario.name}")
            start = _start(config, scenario, home)
            there = scenario
            if config.signal.name == "position":  # to the millimetre: where it stands exactly makes no difference
                there = replace(scenario, start=round(start - rig.middle, 3), start_share=0.0)
            t = np.arange(round(there.duration / period) + 1) * period
            if why := plants.trouble(spec, there.reference(t), there.position(rig.limit("stroke"))):
                progress(f"{spec.name}: {scenario.name} is not played: {why}")
                refused.append({"controller": spec.name, "scenario": scenario.name, "why": why})
            else:
                own = judge(spec, there, setup, loops[spec.name], config.conditions.noise)
                told[spec.name, scenario.name] = _Foretold(spec, scenario, start, own)
    if refused and not told:
        what = "{controller}, {scenario}: {why}".format(**refused[0])
        raise InputError(f"{what}, so nothing moved; make it smaller or slower")
    return told, refused


def _play(
    config: StepConfig,
    told: Mapping[tuple[str, str], _Foretold],
    client: LinkClient,
    played: list[_Course],
    progress: Progress,
) -> str | None:
    """Add to `played` what was foretold, until one is cut short: why that was, or None."""
    period, noisy = config.rig.period.value, not config.conditions.ideal
    try:
        for each in told.values():
            spec, scenario = each.spec, each.scenario
            name = f"{spec.name}, {scenario.name}"
            progress(f"{spec.name}: {scenario.name}")
            t, controller = np.arange(round(scenario.duration / period) + 1) * period, spec.build(period)
            course = scenario.reference(t)
            done = play_course(client, config.rig, controller, course, each.start, noisy=noisy, name=name)
            if len(done.run.rows) > 1:
                played.append((spec, scenario, done))
            if done.ended is not None:
                progress(f"stopped: {done.ended}")
                return done.ended
    except LinkLost as error:
        progress(f"the link is lost: {error}")
        return f"the link is lost: {error}"
    except KeyboardInterrupt:
        return INTERRUPTED
    return None


def _looked_on(client: LinkClient, opc_ua: int | None, progress: Progress) -> AbstractContextManager[object]:
    """A panel beside the loop, where one is asked for; its stop is that of Ctrl-C."""
    if opc_ua is None:
        return nullcontext()
    progress(f"for a panel: opc.tcp://127.0.0.1:{opc_ua}/")
    return opc_ua_server(supervised_loop(client, interrupt_main), opc_ua)


def _home(config: StepConfig, static: Record) -> float:
    """The value of the controlled signal at rest."""
    return float(static.signals[config.signal.name].mean())


def _start(config: StepConfig, scenario: Scenario, home: float) -> float:
    """The start of a scenario: the one it says, else where the rig stood at first."""
    position = scenario.position(config.rig.limit("stroke"))
    return config.rig.middle + position if position and config.signal.name == "position" else home


def _only_command(scenario: Scenario) -> bool:
    """Whether nothing but the jack moves: no far end, no load."""
    return not (scenario.travel or scenario.load)


def _records(played: list[_Course]) -> dict[str, Record]:
    records = {}
    for spec, scenario, each in played:
        name = f"{identifier(spec.name)}-{scenario.name}"
        records[name] = each.record
        if each.back is not None:
            records[f"{name}-back"] = each.back
    return records
