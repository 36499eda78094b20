"""What a platform is, and what follows from its numbers."""

from typing import Any

from ...base.units import from_si
from ...linear.platform_modes import platform_equilibrium, platform_modes
from ...loop.platform.reach import reach
from ...plant import build_platform
from ...rigs.platform import AXES, Platform
from ...rigs.platform.effects import EFFECTS
from ...rigs.platform.platform import JOINTS, LEG, PAYLOAD, PLACE
from .describe import number_row


def describe_platform(platform: Platform) -> dict[str, Any]:
    """Every number of a platform and of its first leg, its modes, and how far it goes along each axis; JSON-able, as
    `describe` has it of a rig."""
    specs = {**PAYLOAD, **PLACE, **JOINTS}
    rows = [number_row(number, specs[number.name].meaning) for number in platform.numbers.values()]
    rows += [number_row(number, f"leg: {LEG[name].meaning}") for name, number in platform.legs[0].numbers.items()]
    jack = platform.legs[0].rig.name
    head = {"name": platform.name, "title": platform.title, "source": platform.source}
    effects = [
        {
            "name": effect.label,
            "formula": "",
            "numbers": [number_row(n, EFFECTS[effect.name][n.name].meaning) for n in effect.numbers.values()],
        }
        for effect in platform.effects
    ]
    kinds = {"kind": f"platform on six jacks, {jack}", "valve": "", "corrector": "", "jack": jack}
    return {**head, **kinds, "numbers": rows, "effects": effects, "sessions": [], "derived": _derived(platform)}


def _derived(platform: Platform) -> list[dict[str, Any]]:
    plant = build_platform(platform)
    smooth = plant.without_dry_friction()
    modes = platform_modes(platform, plant, platform_equilibrium(plant, p=smooth), smooth)
    rows = []
    for i, mode in enumerate(modes):
        axes = sorted(zip(abs(mode.shape), AXES, strict=True), reverse=True)
        words = " with ".join(axis for size, axis in axes if size > 0.1)
        rows.append((f"mode {i + 1}", mode.hz, "Hz", f"at home under gravity: {words}"))
        rows.append(("its damping", mode.zeta, "1", "model at home, without dry friction"))
    for i, (axis, ends) in enumerate(reach(platform).items()):
        unit, si = ("mm", "m") if i < 3 else ("deg", "rad")
        for end in ends:
            how = "from home, within stroke, joint angles and forces at rest"
            rows.append((f"reach, {axis}", float(from_si(end, unit, si)), unit, how))
    return [dict(zip(("name", "value", "unit", "how"), row, strict=True)) for row in rows]
