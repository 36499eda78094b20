"""Controllers of an experiment at a live rig: its scenarios played, judged as `run` judges them, and recorded."""

from _thread import interrupt_main
from contextlib import AbstractContextManager, nullcontext
from itertools import product

import numpy as np

from ...base.errors import LinkLost
from ...control.controller_spec import ControllerSpec
from ...control.export.sections import identifier
from ...link.client import LinkClient
from ...link.course import Played, play_course, rest_record
from ...link.judged import Judged, judge_played, wire_rig
from ...link.opc_ua import opc_ua_server, supervised_loop
from ...link.wire_loop import INTERRUPTED
from ...loop.rows import linear_loops, loop_setup
from ...loop.scenarios import Scenario
from ...records import Record
from ..common.design_numbers import Subject
from ..common.outcome import Outcome, Progress, Stage
from ..common.step_experiment import StepConfig
from ..common.wire_campaign import wire_campaign
from .page import drive_page

_Course = tuple[ControllerSpec, Scenario, Played]


def run_drive(config: StepConfig, at: str, token: str, opc_ua: int | None, stage: Stage, progress: Progress) -> Outcome:
    """`rows` as of `run`, measured at the rig; `predicted`, the same of the experiment's rig in simulation; `late`
    readings; `ended`, why playing stopped before its end, or None; `left_out`, scenarios that need more than a command.
    """
    with LinkClient(at, token) as client, _looked_on(client, opc_ua, progress):
        progress(f"{client.hello.rig} at {at}, {'lockstep' if client.hello.lockstep else 'real time'}")
        rig, static = wire_rig(config.rig, client), rest_record(client)
        played = list[_Course]()
        ended = _play(config, client, played, progress)
        name = client.hello.rig
    judged = list[Judged]()
    try:
        setup = loop_setup(rig)
        loops = {spec.name: linear_loops(spec, setup) for spec in config.controllers}
        for spec, scenario, each in played:
            judged.append(judge_played(config.conditions, spec, scenario, each, setup, loops[spec.name]))
    except KeyboardInterrupt:  # what was recorded is left in any case
        ended = INTERRUPTED
    metrics = {
        "rig": name,
        "rows": [{**each.row, "rig": name} for each in judged],
        "predicted": [each.prediction for each in judged],
        "late": sum(each.run.late for *_, each in played),
        "ended": ended,
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


def _play(config: StepConfig, client: LinkClient, played: list[_Course], progress: Progress) -> str | None:
    """Add to `played` every controller in every scenario that a command alone can play, until one is cut short: why
    that was, or None."""
    period, home = config.rig.period.value, None
    try:
        for spec, scenario in product(config.controllers, filter(_only_command, config.scenarios)):
            progress(f"{spec.name}: {scenario.name}")
            t = np.arange(round(scenario.duration / period) + 1) * period
            controller = spec.build(period)
            home = _level(client, controller.measures[0]) if home is None else home
            start = _start(config, scenario, home)
            each = play_course(
                client, config.rig, controller, scenario.reference(t), start, noisy=not config.conditions.ideal
            )
            if len(each.run.rows) > 1:
                played.append((spec, scenario, each))
            if each.ended is not None:
                progress(f"stopped: {each.ended}")
                return each.ended
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


def _level(client: LinkClient, signal: str) -> float:
    """Where a signal stands now."""
    value = client.on().values[client.hello.names.index(signal)]
    client.off()
    return value


def _start(config: StepConfig, scenario: Scenario, home: float) -> float:
    """Where a scenario starts: where it says, else where the rig stood at first."""
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
