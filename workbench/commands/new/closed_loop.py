"""A rig of which only a label is known, in the loop of a controller that somebody else made.

Reference and response of such a loop tell its speed gain, its delay and its zero. The rest is taken from the label and
from rules of thumb, within bounds as wide as these are rough: intervals of what is told count them.
"""

import math
from collections.abc import Mapping
from string import Template
from typing import Any

from ...base.toml_text import toml_text
from ...base.units import Spec, from_si
from .experiments import TEMPLATES

LABEL = {
    "force": Spec("N", 10.0, 1e8, "rated force of the jack"),
    "stroke": Spec("m", 1e-3, 20.0, "whole stroke"),
    "speed": Spec("m/s", 1e-4, 20.0, "fastest speed, by the label or the pump"),
    "M": Spec("kg", 1e-2, 1e6, "moving mass: piston, grips, platen"),
}
"""What is asked, in turn."""
EXAMPLES = {"force": "100 kN", "stroke": "150 mm", "speed": "0.5 m/s", "M": "100 kg"}
_SUPPLY, _RETURN = 207e5, 3e5  # Pa
_SHARE = 0.95  # of supply pressure times area, that makers call the rated force
_BETA, _DAMPING = 1e9, 0.05  # Pa; of the mass on its oil
_DEAD = 0.1  # of the swept volume
_READ = 2e-5  # of the range: noise and resolution of a sensor
_MOVED = 0.02  # of half the stroke
_SPEED_GAIN, _SPOOL = 20.0, 300.0  # 1/s; Hz


def closed_loop_files(label: Mapping[str, float], name: str) -> dict[str, str]:
    """The text of every file of a starter folder, by its path."""
    half = label["stroke"] / 2
    open_ones = {"rig": name, "gain": f"{1 / half:.6g}", "size": f"{1e3 * _MOVED * half:.2g}"}
    made = {
        file.name: Template(file.read_text("utf-8")).substitute(open_ones)
        for file in sorted((TEMPLATES / "closed_loop").iterdir(), key=lambda file: file.name)
    }
    return {"rig.toml": closed_loop_rig(label, name), **made}


def closed_loop_rig(label: Mapping[str, float], name: str) -> str:
    """The text of a rig file for the numbers of LABEL [SI]."""
    label = {key: float(f"{value:.6g}") for key, value in label.items()}  # so that half of it is written exactly
    area = label["force"] / (_SHARE * (_SUPPLY - _RETURN))
    swept, room = area * label["stroke"], (0.3 * _DEAD, 3 * _DEAD)
    mode = math.sqrt(4 * _BETA * area**2 / ((1 + 2 * _DEAD) * swept * label["M"]))  # rad/s, of mid stroke
    opened = area * label["speed"] / math.sqrt((_SUPPLY - _RETURN) / 2)  # m^3/s/Pa^0.5 at full command
    drag = 2 * _DAMPING * mode * label["M"]  # N s/m
    said, thumb = "label", "rule of thumb"
    return toml_text({
        "name": name,
        "title": f"a jack of {label['force'] / 1e3:g} kN and {1e3 * label['stroke']:g} mm in the loop of its maker",
        "supply": {
            "Ps": _number(_SUPPLY, "bar", "Pa", f"{thumb}: what most testing machines have"),
            "Pr": _number(_RETURN, "bar", "Pa", thumb),
        },
        "oil": {"beta": _number(_BETA, "GPa", "Pa", f"{thumb}: mineral oil with some air", (0.5 * _BETA, 1.5 * _BETA))},
        "valve": {
            "kind": "second-order",
            "f0": _number(_SPOOL, "Hz", "Hz", thumb, known=(0.5 * _SPOOL, 1.5 * _SPOOL)),
            "zeta": _number(0.8, "1", "1", thumb, known=(0.5, 1.1)),
            "z0": _number(0.0, "1", "1", "its maker's zero", (-0.05, 0.05)),
            "K3": _number(opened / 1e-3, "m^2/s/Pa^0.5", "m^2/s/Pa^0.5", f"{said}: the fastest speed; with loop_gain "
                          "it makes the speed gain, and only that is seen"),
            "z3max": _number(1e-3, "mm", "m", "a scale: the spool is not measured"),
            "eps": _number(2e-6, "um", "m", thumb, (0.5e-6, 8e-6)),
            "n": _number(1.0, "1", "1", "one valve, or all of them as one"),
        },
        "jack": {
            "kind": "double-rod",
            "Aj": _number(area, "cm^2", "m^2", f"{said}: rated force over {_SHARE:g} of the pressure"),
            "S": _number(label["stroke"], "mm", "m", said),
            "xmid": _number(0.0, "mm", "m", "positions count from mid stroke"),
            "V0": _number(_DEAD * swept, "l", "m^3", f"{thumb}: {_DEAD:g} of the rest", tuple(swept * k for k in room)),
            "Cl": _number(1e-12, "m^3/s/Pa", "m^3/s/Pa", thumb),
            "ke": _number(2e8, "N/m", "N/m", thumb),
            "ce": _number(4e5, "N s/m", "N s/m", thumb),
        },
        "load": {
            "kind": "measured",
            "M": _number(label["M"], "kg", "kg", said, (0.5 * label["M"], 2 * label["M"])),
            "b": _number(drag, "N s/m", "N s/m", f"{thumb}: damps the oil to {_DAMPING:g}", (0.0, 10 * drag)),
            "ks": _number(0.0, "N/m", "N/m", "no specimen that is described"),
            "cs": _number(0.0, "N s/m", "N s/m", "no specimen that is described"),
        },
        "inner": {
            "controls": "position",
            "full_command": f"{label['stroke'] / 2!r} m",
            "loop_gain": _number(_SPEED_GAIN / label["speed"], "1/m", "1/m", f"a speed gain of {_SPEED_GAIN:g} 1/s",
                                 (_SPEED_GAIN / label["speed"] / 50, _SPEED_GAIN / label["speed"] * 50)),
            "loop_delay": _number(2e-3, "ms", "s", "not known", (0.0, 50e-3)),
        },
        "limits": {
            "stroke": _number(label["stroke"] / 2, "mm", "m", said),
            "speed": _number(2 * label["speed"], "m/s", "m/s", "twice the label's"),
            "force": _number(label["force"], "kN", "N", said),
            "command_rate": _number(200.0, "1/s", "1/s", thumb),
        },
        "control": {"period": _number(1e-3, "ms", "s", thumb)},
        "sensors": {
            "position": {name: _number(_READ * label["stroke"], "um", "m", thumb) for name in ("noise", "resolution")},
            "force": {name: _number(_READ * label["force"], "N", "N", thumb) for name in ("noise", "resolution")},
        },
    })  # fmt: skip


def _number(
    value: float, unit: str, si: str, source: str, bounds: tuple[float, ...] = (), known: tuple[float, ...] = ()
) -> dict[str, Any]:
    """A number with bounds, within which it is fitted, or pinned but `known` within an interval alone."""

    def shown(number: float) -> float:
        return float(f"{float(from_si(number, unit, si)):.7g}")

    within = {"bounds": bounds, "interval": known}
    ends = {key: [shown(end) for end in pair] for key, pair in within.items() if pair}
    return {"value": shown(value), "unit": unit, "source": source, **ends}
