"""The page on which a served rig is seen live, and switched."""

import json
import time
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from ...base.errors import InputError
from ...base.signals import output_signal
from ...base.units import from_si
from ...link import datagrams
from ...link.rig_server import RigServer
from ..common.page_server import KINDS, Answers, Files

_SHOWN = ("position", "pa", "pb", "spool", "force", "supply")
_SWITCHES = {"on": datagrams.ON, "off": datagrams.OFF, "reset": datagrams.RESET}


class RigPage:
    """What the page of a server shows, true values in the units that people read."""

    def __init__(self, server: RigServer) -> None:
        self._server, self._began = server, time.monotonic()
        plant = server.rig.bench.plant
        names = [name for name in plant.outputs if name.rpartition(".")[2] in _SHOWN]
        self._shown = [(plant.output(name), name, output_signal(name)) for name in names]

    def start(self) -> dict[str, Any]:
        """What the page has to know before it asks."""
        bench = self._server.rig.bench
        limits = {limit.signal: list(limit.ends) for limit in bench.limits}
        signals = [
            {"name": name, "unit": s.unit, "limits": from_si(limits.get(name, []), s.unit, s.si).tolist()}
            for _, name, s in self._shown
        ]
        commands = [{"name": each.name, "unit": "1", "limits": [each.low, each.high]} for each in bench.commands]
        where = "udp://{}:{}".format(*self._server.address)
        return {"rig": bench.name, "at": where, "period": bench.period, "signals": signals, "commands": commands}

    @property
    def answers(self) -> Answers:
        """What the page may ask for, by name."""
        return {"now": self._now, "switch": self._switch}

    def _now(self, _: Mapping[str, Any]) -> dict[str, Any]:
        rig, server = self._server.rig, self._server
        outputs = rig.outputs
        values = [float(from_si(outputs[place], s.unit, s.si)) for place, _, s in self._shown]
        return {
            "t": time.monotonic() - self._began,
            "state": rig.state,
            "trip": rig.trip or "",
            "watchdog": bool(rig.flags & datagrams.WATCHDOG),
            "values": values,
            "commands": rig.command,
            "periods": server.periods,
            "missed": server.pace.missed,
            "dropped": server.dropped,
        }

    def _switch(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        what = asked.get("to")
        if what not in _SWITCHES:
            raise InputError("to: must be on, off or reset; reload the page")
        self._server.wish(_SWITCHES[what])
        return {}


def page_files(start: Mapping[str, Any]) -> Files:
    """Kind and content of what the page is made of, by name."""
    assets = files("workbench") / "commands" / "serve" / "assets"
    html = Template((assets / "page.html").read_text("utf-8"))
    data = json.dumps(start, allow_nan=False).replace("<", "\\u003c")  # no text can end the script element
    page = html.substitute(title=escape(f"{start['rig']} at {start['at']}"), start=data).encode()
    own = {name: (KINDS[name.rpartition(".")[2]], (assets / name).read_bytes()) for name in ("rig.js", "rig.css")}
    return {**own, "": (KINDS["html"], page)}
