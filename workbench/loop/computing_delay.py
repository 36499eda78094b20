"""What it costs a loop that its commands come late by what the controller computes."""

from collections.abc import Sequence
from typing import Any

from ..control.controller_spec import ControllerSpec
from .rig_variations import with_delay
from .rows import LoopSetup, linear_loops, loop_setup, play, row
from .scenarios import Scenario


def delayed_rows(controller: ControllerSpec, scenarios: Sequence[Scenario], setup: LoopSetup) -> list[dict[str, Any]]:
    """Rows of the scenarios with the controller's computing delay on the rig's commands.

    A controller whose design has the number `delay` is run again expecting it. Each row has besides those of `row`
    `computing_delay_s` [s] and `expected`.
    """
    late = loop_setup(with_delay(setup.rig, controller.computing_delay))
    expecting = controller.expecting_its_delay()
    designs = {False: controller} if expecting == controller else {False: controller, True: expecting}
    rows = []
    for expected, design in designs.items():
        loops = linear_loops(design, late)
        for scenario in scenarios:
            numbers = row(design, scenario, late, play(design, scenario, late), loops)
            rows.append({**numbers, "computing_delay_s": controller.computing_delay, "expected": expected})
    return rows
