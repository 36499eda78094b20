"""The rig as it is served: at another rate, with effects that its file does not have, on a specimen."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ...base.errors import InputError
from ...base.units import quantity
from ...loop.rig_variations import RIG_SET, variation
from ...rigs.platform import Platform, load_rig_or_platform
from ...rigs.rig import Rig
from ...rigs.rig_file import read_effects
from ...rigs.schema import CONTROL

FASTEST = 5000.0  # Hz in real time


@dataclass(frozen=True)
class Service:
    """How a rig is served; `host` is empty for this machine alone."""

    lockstep: bool
    seed: int
    ideal: bool
    port: int
    host: str
    token: str
    page_port: int
    opcua: int | None = None


def service(
    wanted: Service, name: str, rate: float | None, effects: Path | None, specimen: str | None
) -> Rig | Platform:
    """The rig or platform to serve. Raises InputError for what cannot be."""
    if wanted.host and not wanted.token:
        raise InputError(f"--bind {wanted.host}: others can reach the rig there; give it a --token")
    rig = load_rig_or_platform(name)
    if effects is not None:
        more = read_effects(effects)
        rig = _changed(rig, lambda each: replace(each, effects=(*each.effects, *more)))
    if specimen is not None:
        if isinstance(rig, Platform):
            raise InputError("--specimen: a platform has its payload on its load cells; serve a rig")
        rig = _on_specimen(rig, specimen)
    if rate is not None:
        rig = _changed(rig, lambda each: _at_rate(each, rate))
    fastest = 1 / (rig.period if isinstance(rig, Platform) else rig.period.value)
    if not wanted.lockstep and fastest > FASTEST * (1 + 1e-9):
        raise InputError(f"--rate {fastest:g}: at most {FASTEST:g} Hz in real time; --lockstep has no limit")
    return rig


def _changed(rig: Rig | Platform, change: Callable[[Rig], Rig]) -> Rig | Platform:
    return rig.with_rigs(change) if isinstance(rig, Platform) else change(rig)


def _at_rate(rig: Rig, rate: float) -> Rig:
    if not rate > 0 or CONTROL["period"].problem(1 / rate):
        raise InputError(f"--rate {rate:g}: {CONTROL['period'].problem(1 / rate) if rate > 0 else 'must be above 0'}")
    return replace(rig, period=replace(rig.period, value=1 / rate, source="--rate"))


def _on_specimen(rig: Rig, specimen: str) -> Rig:
    if specimen in RIG_SET:
        return replace(variation(rig, specimen), name=rig.name)
    try:
        return rig.with_values(ks=quantity(specimen, "N/m"))
    except InputError as error:
        sets = ", ".join(name for name in RIG_SET if name.startswith("stiffness"))
        raise InputError(f"--specimen: {error}; or name one of a rig set: {sets}") from None
