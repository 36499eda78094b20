"""What to record so that names which explain a rig's sessions alike part."""

from collections.abc import Sequence

from ...plant.effects import known_effects

_NUMBERS = {
    "Ps": "the supply gauge while nothing moves",
    "beta": "small fast steps, of whose ringing the period counts",
    "V0": "small fast steps near both ends of the stroke",
    "psi3": "spool steps of 2 % and of 20 %",
    "Km": "the pilot's current at a held command",
    "Kp": "spool steps of 2 % and of 20 %",
    "K3": "steady strokes at a quarter, a half and the whole of the command",
    "eps": "slow strokes through null, at 0.1 to 1 % of the command",
    "Cl": "a held load with the valve shut: how fast it creeps",
    "b": "strokes at two steady speeds without load",
    "M": "the load's mass on a scale, or fast steps with two loads",
}
_SENSORS = {"scale": "{} against a second gauge at two levels", "zero": "{} against a second gauge at rest"}


def to_split(names: Sequence[str]) -> list[str]:
    """What shows each of the names most, one line a name."""
    shows = {effect.name: effect.shows for effect in reversed(known_effects())}
    return [f"{name}: {_shows(name, shows)}" for name in names]


def _shows(name: str, shows: dict[str, str]) -> str:
    sensor, _, part = name.rpartition(".")
    if name in shows:
        return shows[name]
    if part in _SENSORS:
        return _SENSORS[part].format(sensor)
    return _NUMBERS.get(name, "what `jackbench plan` proposes")
