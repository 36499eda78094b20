"""Who may command a served rig, and what it answers to hellos, switches and what it cannot take."""

import socket
import struct
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hmac import compare_digest
from math import isfinite

from ..base.errors import InputError
from ..base.files import WINDOWS
from . import datagrams
from .hello import Hello, channels_of
from .pace import Pace, Times
from .served_rig import OFF, ON, TRIPPED, ServedRig

LOOPBACK = "127.0.0.1"
_SILENT = 3.0  # s: a client that says nothing for so long may be replaced
_WATCHDOG = 0.05  # s without a command, and at least
_LEAST_WATCHDOG = 10  # periods
_ROOM = 2**20  # bytes of datagrams that wait
_PACKET = 2048  # bytes of a datagram that is looked at
_PATIENCE = struct.pack("L", 100) if WINDOWS else struct.pack("ll", 0, 100_000)  # ms, or s and us
_HEARD = (datagrams.HELLO, datagrams.COMMAND, datagrams.SWITCH)

Address = tuple[str, int]


class RigServer(ABC):
    """A served rig on a socket of this machine, commanded by one client at a time; who paces it is a subclass's affair.

    `tell` hears in a sentence of what happens. `token`: what a hello must bring, where it is not empty. Counts
    `periods`, datagrams `dropped` and `trips`; `pace` and `ages` have the times [us] of a service in real time. Raises
    InputError for a port that cannot be had.
    """

    mode: str
    _waits: bool  # for the next datagram, a tenth of a second: then it looks whether it should stop

    def __init__(
        self,
        rig: ServedRig,
        port: int = 0,
        host: str = LOOPBACK,
        token: str = "",
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.rig, self._token, self._tell = rig, token.encode(), tell
        bench = rig.bench
        limits = {limit.signal: limit.ends for limit in bench.limits}
        self.watchdog = max(_LEAST_WATCHDOG, round(_WATCHDOG / bench.period))
        named = bench.name, bench.period, self.mode == "lockstep", bench.commands, channels_of(bench.channels)
        self._hello = Hello(*named, self.watchdog, limits, "off")
        self._socket = _bound(host, port)
        self._owner: Address | None = None
        self._heard = 0.0
        self._released = False  # by its owner, who has switched it off
        self._wishes: list[int] = []
        self._done = threading.Event()
        self.pace, self.ages = Pace(bench.period), Times()
        self.periods = self.dropped = self.trips = 0
        self.cpu_s = 0.0

    @property
    def address(self) -> Address:
        """The address at which it listens."""
        host, port = self._socket.getsockname()
        return host, port

    @property
    def at(self) -> str:
        """The place at which it listens, as a client is told."""
        return "udp://{}:{}".format(*self.address)

    def wish(self, switch: int) -> None:
        """Switch it from this machine: on, off or reset, in its own thread."""
        self._wishes.append(switch)

    def stop(self) -> None:
        """End `serve`."""
        self._done.set()

    def serve(self) -> None:
        """Until `stop`."""
        rig, tripped = self.rig, False
        self._socket.setblocking(self._waits)
        self.pace.start()
        while not self._done.is_set():
            while self._wishes:
                self._switch(self._wishes.pop(0))
            self._turn()
            if rig.condition == TRIPPED and not tripped:
                self.trips += 1
                self._tell(f"tripped: {rig.trip}")
            tripped = rig.condition == TRIPPED
        self.cpu_s = time.thread_time()

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    @abstractmethod
    def _turn(self) -> None:
        """One datagram, or one instant of a clock."""

    @abstractmethod
    def _take(self, sequence: int, values: tuple[float, ...]) -> str:
        """A finite command of the owner for a rig that is not off; why it is refused, if it is."""

    def _has_time(self) -> bool:
        """Whether a stranger is heard now."""
        return True

    def _receive(self, flags: int = 0) -> tuple[bytes, Address] | None:
        """The next datagram and its sender; None where none comes."""
        try:
            return self._socket.recvfrom(_PACKET, flags)
        except OSError:
            return None

    def _hear(self, data: bytes, sender: Address) -> None:
        """A datagram, which is answered or counted."""
        kind, body = datagrams.opened(data) or (datagrams.REFUSAL, b"")
        owns = sender == self._owner
        if kind not in _HEARD or not (owns or self._has_time()):
            self.dropped += 1
        elif kind == datagrams.HELLO:
            self._greet(sender, body)
        elif not owns:
            self._refuse(sender, self._others())
        elif kind == datagrams.SWITCH:
            self._switched(sender, body)
        elif why := self._complaint(body):
            self._refuse(sender, why)

    def _complaint(self, body: bytes) -> str:
        """Why the owner's command is not taken, if it is not."""
        command, m = datagrams.read_command(body), len(self.rig.command)
        if command is None or len(command[1]) != m:
            return f"a command is its sequence number, a u32, and {m} f64: {11 + 8 * m} bytes in all"
        if self.rig.condition == OFF:
            return "the rig is off; switch it on first"
        if not all(map(isfinite, command[1])):
            return "a command is not finite"
        self._heard = time.monotonic()
        return self._take(*command)

    def _switched(self, owner: Address, body: bytes) -> None:
        """The owner switches it."""
        if len(body) != 1 or body[0] not in (datagrams.OFF, datagrams.ON, datagrams.RESET):
            self._refuse(owner, "a switch is one byte: 1 on, 0 off, 2 reset")
            return
        self._heard, self._released = time.monotonic(), body[0] == datagrams.OFF
        self._switch(body[0])
        self._send(datagrams.datagram(datagrams.STATE, self.rig.state.encode()), owner)
        if body[0] == datagrams.ON and self.rig.condition == ON and self.rig.tick == 0 and self._hello.lockstep:
            self._answer()

    def _greet(self, sender: Address, token: bytes) -> None:
        """The hello of a client: it owns the rig from now on, unless another one does."""
        now = time.monotonic()
        if self._token and not compare_digest(token, self._token):
            self._refuse(sender, "wrong token; it is the one that the rig was served with")
            return
        if self._owner not in (None, sender):
            if not self._released and now - self._heard < _SILENT:
                self._refuse(sender, self._others())
                return
            why = "is done" if self._released else "is silent"
            self._tell(f"{_named(self._owner)} {why}; {_named(sender)} takes over")
            self._switch(datagrams.OFF)
        elif self._owner is None:
            self._tell(f"{_named(sender)} says hello")
        self._owner, self._heard, self._released = sender, now, False
        hello = self._hello.in_state(self.rig.state).text()
        self._send(datagrams.datagram(datagrams.RIG, hello.encode()), sender)

    def _switch(self, what: int) -> None:
        rig, condition = self.rig, self.rig.condition
        if what == datagrams.ON and condition == OFF:
            rig.switch_on()
            self._tell("on")
        elif what == datagrams.OFF and condition == ON:
            rig.switch_off()
            if self._hello.lockstep:
                rig.run_out()
            self._tell("off")
        elif what == datagrams.RESET and condition == TRIPPED:
            try:
                rig.reset()
                self._tell("reset")
            except InputError as error:
                self._tell(f"cannot be reset: {error}")

    def _others(self) -> str:
        if self._owner is None:
            return "say hello first"
        return f"{_named(self._owner)} commands this rig; another client is served when that one is gone"

    def _refuse(self, sender: Address, why: str) -> None:
        self.dropped += 1
        self._send(datagrams.datagram(datagrams.REFUSAL, why.encode()), sender)

    def _answer(self) -> None:
        """The reading goes to the owner."""
        if self._owner:
            self._send(self.rig.reading(), self._owner)

    def _send(self, data: bytes | bytearray, to: Address) -> None:
        """What cannot be sent is lost, as any datagram may be."""
        try:
            self._socket.sendto(data, to)
        except OSError:
            self.dropped += 1


@contextmanager
def in_background(server: RigServer) -> Iterator[RigServer]:
    """The server at work in a thread of its own, which ends with the context."""
    thread = threading.Thread(target=server.serve)
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()
        server.close()


def _bound(host: str, port: int) -> socket.socket:
    where = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    where.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM)
    where.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _PATIENCE)  # of Python's own timeouts each costs a poll
    try:
        where.bind((host, port))
    except (OSError, OverflowError) as error:
        where.close()
        what = error.strerror if isinstance(error, OSError) else "no such port"
        raise InputError(f"{host}:{port}: {what}; choose another port, or leave it out for a free one") from None
    return where


def _named(address: Address | None) -> str:
    return "nobody" if address is None else f"{address[0]}:{address[1]}"
