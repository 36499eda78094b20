"""Rigs served in this process, and clients that know nothing but the link's own page."""

import json
import socket
import struct
import time
from contextlib import AbstractContextManager
from functools import cache

from workbench.link.bench import Bench, bench
from workbench.link.paced import LockstepServer, RealTimeServer
from workbench.link.rig_server import RigServer, in_background
from workbench.link.served_rig import ServedRig
from workbench.rigs.rig_file import load_rig

HEAD = b"JBRIG\x01"


@cache
def jack_bench(ideal: bool = False, computes: bool = True) -> Bench:
    return bench(load_rig("jack-10t"), computes, ideal)


def served(own: Bench, lockstep: bool = True, seed: int = 3, token: str = "") -> AbstractContextManager[RigServer]:
    return in_background((LockstepServer if lockstep else RealTimeServer)(ServedRig(own, seed), token=token))


def at(server: RigServer) -> str:
    return server.at


class Stranger:
    """A client of the standard library alone, which sends what it is told to and gives back what comes."""

    def __init__(self, server: RigServer) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(server.address)
        self.socket.settimeout(2.0)
        self.hello: dict = {}

    def __enter__(self) -> "Stranger":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, kind: int, body: bytes = b"") -> None:
        self.socket.send(HEAD + bytes([kind]) + body)

    def command(self, sequence: int, *values: float) -> None:
        self.send(2, struct.pack(f"<I{len(values)}d", sequence, *values))

    def take(self, kind: int) -> bytes:
        """The body of the next datagram of a kind. Raises TimeoutError where only others come for some seconds."""
        until = time.monotonic() + 5.0
        while time.monotonic() < until:
            data = self.socket.recv(65507)
            if data[6] == kind:
                return data[7:]
        raise TimeoutError

    def silent(self) -> bool:
        self.socket.settimeout(0.05)
        try:
            self.socket.recv(65507)
        except TimeoutError:
            return True
        finally:
            self.socket.settimeout(2.0)
        return False

    def greet(self, token: bytes = b"") -> dict:
        self.send(0, token)
        self.hello = json.loads(self.take(1))
        return self.hello

    def switch(self, to: int) -> str:
        self.send(4, bytes([to]))
        return self.take(5).decode()

    def reading(self) -> tuple[int, int, int, tuple[float, ...]]:
        """Status, sequence, tick, values."""
        body = self.take(3)
        return *struct.unpack_from("<BIQ", body), struct.unpack_from(f"<{len(self.hello['channels'])}d", body, 13)

    def channel(self, name: str) -> int:
        return [each["name"] for each in self.hello["channels"]].index(name)
