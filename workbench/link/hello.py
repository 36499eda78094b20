"""What a rig says of itself when a client greets it: channels, units, period, limits, state."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import Any

from ..base.errors import InputError
from ..base.signals import output_signal
from .datagrams import STATES


@dataclass(frozen=True)
class CommandRange:
    """A command by name, its unit, and the values that the rig takes."""

    name: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class Channel:
    """A signal that every reading has, by name, and its SI unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class Hello:
    """A rig's hello. `period` [s]; `limits`: the lowest and the highest value of a signal at which it stays on."""

    rig: str
    period: float
    lockstep: bool
    commands: tuple[CommandRange, ...]
    channels: tuple[Channel, ...]
    watchdog_periods: int
    limits: Mapping[str, tuple[float, float]]
    state: str

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the channels."""
        return tuple(channel.name for channel in self.channels)

    def in_state(self, state: str) -> "Hello":
        """This hello in another state."""
        return replace(self, state=state)

    def text(self) -> str:
        """The text that the link sends."""
        table = {
            "rig": self.rig,
            "period_s": self.period,
            "mode": "lockstep" if self.lockstep else "realtime",
            "commands": [asdict(each) for each in self.commands],
            "channels": [asdict(each) for each in self.channels],
            "watchdog_periods": self.watchdog_periods,
            "limits": {name: list(pair) for name, pair in self.limits.items()},
            "state": self.state,
        }
        return json.dumps(table, allow_nan=False)


def channels_of(names: tuple[str, ...]) -> tuple[Channel, ...]:
    """Channels of outputs by name."""
    return tuple(Channel(name, output_signal(name).si) for name in names)


def read_hello(text: str, where: str) -> Hello:
    """The hello in a JSON text. Raises InputError that names `where` it came from and what it lacks."""
    try:
        table = json.loads(text)
        hello = Hello(
            rig=str(table["rig"]),
            period=float(table["period_s"]),
            lockstep={"lockstep": True, "realtime": False}[table["mode"]],
            commands=tuple(CommandRange(*_entries(each, "name unit low high")) for each in table["commands"]),
            channels=tuple(Channel(*_entries(each, "name unit")) for each in table["channels"]),
            watchdog_periods=int(table["watchdog_periods"]),
            limits={str(name): (float(low), float(high)) for name, (low, high) in table["limits"].items()},
            state=str(table["state"]),
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        what = f"{type(error).__name__}: {error}"
        raise InputError(f"{where}: its hello is not one of the link ({what}); mend the rig") from None
    if not (isfinite(hello.period) and hello.period > 0 and hello.commands and hello.state in STATES):
        raise InputError(f"{where}: its hello has no period, no command or no state; mend the rig")
    return hello


def _entries(table: Mapping[str, Any], names: str) -> list[Any]:
    return [table[name] for name in names.split()]
