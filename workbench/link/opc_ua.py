"""Supervision over OPC UA: what a rig or a loop does as nodes with units, and switches as methods.

Needs `pip install 'jackbench[opcua]'`. A panel looks on several times a second; control is the link's affair.
"""

import asyncio
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any

from ..base.errors import InputError
from . import datagrams
from .client import LinkClient
from .hello import channels_of
from .rig_server import RigServer

NAMESPACE = "urn:jackbench"
_EVERY = 0.1  # s
_STARTS = 20.0  # s


@dataclass(frozen=True)
class Supervised:
    """What is shown: `values` gives a snapshot by node (number, truth value or text), `units` of the numbers,
    `switches` are called by name."""

    name: str
    values: Callable[[], Mapping[str, float | bool | str]]
    units: Mapping[str, str]
    switches: Mapping[str, Callable[[], None]]


def supervised_rig(server: RigServer) -> Supervised:
    """A served rig: its state and readings, and start, stop and reset."""
    rig, bench = server.rig, server.rig.bench
    units = {each.name: each.unit for each in channels_of(bench.channels)}
    units |= {each.name: each.unit for each in bench.commands}

    def values() -> dict[str, float | bool | str]:
        outputs = rig.outputs
        readings = {name: float(outputs[bench.plant.output(name)]) for name in bench.channels}
        commands = dict(zip((each.name for each in bench.commands), rig.command, strict=True))
        told = {"state": rig.state, "trip": rig.trip or "", "mode": server.mode, "trips": float(server.trips)}
        return {**told, **readings, **commands}

    wishes = {"start": datagrams.ON, "stop": datagrams.OFF, "reset": datagrams.RESET}
    return Supervised(bench.name, values, units, {name: partial(server.wish, what) for name, what in wishes.items()})


def supervised_loop(client: LinkClient, stop: Callable[[], None]) -> Supervised:
    """A loop at a live rig: what it is asked for, what it commands, the readings, and stop."""
    hello = client.hello
    units = {each.name: each.unit for each in hello.channels} | {each.name: each.unit for each in hello.commands}

    def values() -> dict[str, float | bool | str]:
        latest, asked = client.latest, client.asked
        readings = latest.values if latest else (0.0,) * len(hello.channels)
        status = latest.status if latest else 0
        told = {"on": bool(status & datagrams.IS_ON), "tripped": bool(status & datagrams.IS_TRIPPED)}
        told |= {"watchdog": bool(status & datagrams.WATCHDOG), "reference": asked[0], hello.commands[0].name: asked[1]}
        return {**told, **dict(zip(hello.names, readings, strict=True))}

    return Supervised(hello.rig, values, units, {"stop": stop})


@contextmanager
def opc_ua_server(shown: Supervised, port: int) -> Iterator[str]:
    """Nodes under Objects/NAME at opc.tcp://127.0.0.1:PORT, as long as the block lasts; the address. Raises InputError
    where the package is missing, or the port cannot be had."""
    if find_spec("asyncua") is None:
        raise InputError("--opcua: needs the package asyncua; pip install 'jackbench[opcua]'")
    url = f"opc.tcp://127.0.0.1:{port}/"
    ready, over, failed = threading.Event(), threading.Event(), list[BaseException]()

    def run() -> None:
        try:
            asyncio.run(_serve(shown, url, ready, over))
        except BaseException as error:  # told in the thread that asked
            failed.append(error)
        ready.set()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    ready.wait(_STARTS)
    if failed:
        raise InputError(f"--opcua {port}: {failed[0]}; choose another port") from None
    try:
        yield url
    finally:
        over.set()
        thread.join()


async def _serve(shown: Supervised, endpoint: str, ready: threading.Event, over: threading.Event) -> None:
    from asyncua.server.server import Server

    server = Server()
    await server.init()
    server.set_endpoint(endpoint)
    server.set_server_name("jackbench")
    space = await server.register_namespace(NAMESPACE)
    folder = await server.nodes.objects.add_object(space, shown.name)
    nodes = {name: await _node(folder, space, name, value, shown.units) for name, value in shown.values().items()}
    for name, call in shown.switches.items():
        await folder.add_method(space, name, _method(call))
    async with server:
        ready.set()
        while not over.is_set():
            for name, value in shown.values().items():
                await nodes[name].write_value(value)
            await asyncio.sleep(_EVERY)


async def _node(folder: Any, space: int, name: str, value: float | bool | str, units: Mapping[str, str]) -> Any:
    """A node that clients read, with its unit as a property."""
    node = await folder.add_variable(space, name, value)
    if name in units:
        await node.add_property(space, "EngineeringUnits", units[name])
    return node


def _method(call: Callable[[], None]) -> Callable[..., Any]:
    async def method(_parent: Any, *_arguments: Any) -> list[Any]:
        call()
        return []

    return method
