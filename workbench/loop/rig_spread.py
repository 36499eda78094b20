"""How the numbers of a controller spread over a set of rigs."""

from collections.abc import Sequence
from typing import Any


def spread_over_rigs(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line for each controller and scenario of `rows` (as `rows.row` gives them, one a rig).

    Least and most settling time [s], overshoot [percent], peak deviation [SI] and Ms [1], None where no rig has it, and
    the names of the rigs on which the loop does not settle or is unstable.
    """
    lines = []
    for controller, scenario in dict.fromkeys((row["controller"], row["scenario"]) for row in rows):
        played = [row for row in rows if (row["controller"], row["scenario"]) == (controller, scenario)]
        line: dict[str, Any] = {"controller": controller, "scenario": scenario}
        for key in ("settling_s", "overshoot_percent", "peak_deviation", "ms"):
            values = [row[key] for row in played if row[key] is not None]
            line |= {f"{key}_least": min(values, default=None), f"{key}_most": max(values, default=None)}
        line["unsettled"] = [row["rig"] for row in played if row["settling_s"] is None]
        line["unstable"] = [row["rig"] for row in played if row["stable"] is False]
        lines.append(line)
    return lines
