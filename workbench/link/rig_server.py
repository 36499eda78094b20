"""Who may command a served rig, and what it answers: hellos, switches and refusals; commands are machine code's."""

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hmac import compare_digest

from ..base.errors import InputError
from . import datagrams
from .hello import Hello, channels_of
from .machine_code import exact_timers
from .served_rig import OFF, ON, TRIPPED, ServedRig

LOOPBACK = "127.0.0.1"
_SILENT = 3.0  # s: a client that says nothing for so long may be replaced
_POLL = 100_000  # us: how often a rig in lockstep looks whether it should stop
_NOISE, _DATAGRAM = 2, 1  # why the machine code came back
_ROOM = 2**20  # bytes of datagrams that wait

Address = tuple[str, int]


class RigServer:
    """A served rig on a socket of this machine, commanded by one client at a time.

    `tell` hears in a sentence of what happens. `token`: what a hello must bring, where it is not empty. Raises
    InputError for a port that cannot be had.
    """

    def __init__(
        self,
        rig: ServedRig,
        lockstep: bool,
        port: int = 0,
        host: str = LOOPBACK,
        token: str = "",
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.rig, self._lockstep, self._token, self._tell = rig, lockstep, token.encode(), tell
        bench = rig.bench
        limits = {limit.signal: limit.ends for limit in bench.limits}
        channels, watchdog = channels_of(bench.channels), rig.job.watchdog
        self._hello = Hello(bench.name, bench.period, lockstep, bench.commands, channels, watchdog, limits, "off")
        self._socket = _bound(host, port)
        rig.job.socket = self._socket.fileno()
        self._owner: Address | None = None
        self._heard, self._seen = 0.0, (0, 0)
        self._released = False  # by its owner, who has switched it off
        self._wishes: list[int] = []
        self._done = threading.Event()
        self.trips = 0
        self.cpu_s = 0.0

    @property
    def address(self) -> Address:
        """Where it listens."""
        host, port = self._socket.getsockname()
        return host, port

    @property
    def at(self) -> str:
        """Where it listens, as a client is told."""
        return "udp://{}:{}".format(*self.address)

    @property
    def mode(self) -> str:
        """Lockstep or realtime."""
        return "lockstep" if self._lockstep else "realtime"

    def wish(self, switch: int) -> None:
        """Switch it from this machine: on, off or reset, in its own thread."""
        self._wishes.append(switch)
        self.rig.job.attention = 1

    def stop(self) -> None:
        """End `serve`."""
        self._done.set()
        self.rig.job.attention = 1

    def serve(self) -> None:
        """Until `stop`: machine code, and what it leaves to Python."""
        job, rig = self.rig.job, self.rig
        run = rig.code.lockstep if self._lockstep else rig.code.realtime
        exact_timers()
        job.due = time.monotonic_ns() + job.period_ns
        job.flags, tripped = 0, False
        while True:
            why = run(rig.address)
            if why == _DATAGRAM:
                self._answer()
            elif why == _NOISE:
                rig.draw_noise()
            elif self._done.is_set():
                break
            else:
                self._grant()
            tripped = self._notice(tripped)
        self.cpu_s = time.thread_time()

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def _notice(self, before: bool) -> bool:
        """Whether it has tripped, which is told once."""
        tripped = self.rig.job.state == TRIPPED
        if tripped and not before:
            self.trips += 1
            self._tell(f"tripped: {self.rig.trip}")
        return tripped

    def _grant(self) -> None:
        self.rig.job.attention = 0
        while self._wishes:
            self._switch(self._wishes.pop(0))

    def _answer(self) -> None:
        """The datagram that machine code left to Python."""
        job, sender = self.rig.job, _sender(self.rig.sender)
        kind, body = datagrams.opened(self.rig.packet) or (datagrams.REFUSAL, b"")
        if kind == datagrams.HELLO:
            self._greet(sender, body)
        elif sender != self._owner:
            job.dropped += 1
            self._refuse(sender, self._others() if self._owner else "say hello first")
        elif kind == datagrams.SWITCH and len(body) == 1 and body[0] in (datagrams.OFF, datagrams.ON, datagrams.RESET):
            self._heard = time.monotonic()
            self._released = body[0] == datagrams.OFF
            self._switch(body[0])
            self._send(datagrams.STATE, self.rig.state.encode())
            if body[0] == datagrams.ON and job.state == ON and job.tick == 0 and self._lockstep:
                self.rig.code.answer(self.rig.address)
        else:
            job.dropped += 1
            self._refuse(sender, self._complaint(kind, body))

    def _complaint(self, kind: int, body: bytes) -> str:
        """Why the owner's datagram is not taken."""
        if kind == datagrams.SWITCH:
            return "a switch is one byte: 1 on, 0 off, 2 reset"
        read, m = datagrams.read_command(body), self.rig.job.commands
        if read is None or len(read[1]) != m:
            return f"a command is its sequence number, a u32, and {m} f64: {11 + 8 * m} bytes in all"
        if self.rig.job.state == OFF:
            return "the rig is off; switch it on first"
        if not all(abs(value) < float("inf") for value in read[1]):
            return "a command is not finite"
        last, tick = self.rig.job.sequence, self.rig.job.tick
        if self._lockstep:
            return f"command {read[0]} is not the next one, {last + 1}"
        when = f'command {read[0]} comes after {last}, {tick} periods after "on"'
        return f"old: {when}; a session counts its commands one by one, from 1 on"

    def _greet(self, sender: Address, token: bytes) -> None:
        """The hello of a client: it owns the rig from now on, unless another one does."""
        now = time.monotonic()
        if self._token and not compare_digest(token, self._token):
            self._refuse(sender, "wrong token; it is the one that the rig was served with")
            self.rig.job.dropped += 1
            return
        if self._owner not in (None, sender):
            if not self._released and now - self._last_heard() < _SILENT:
                self._refuse(sender, self._others())
                self.rig.job.dropped += 1
                return
            why = "is done" if self._released else "is silent"
            self._tell(f"{_named(self._owner)} {why}; {_named(sender)} takes over")
            self._switch(datagrams.OFF)
        elif self._owner is None:
            self._tell(f"{_named(sender)} says hello")
        self._owner, self._heard, self._released = sender, now, False
        self.rig.take_owner()
        self._send(datagrams.RIG, self._hello.in_state(self.rig.state).text().encode())

    def _last_heard(self) -> float:
        """When the owner last said something [s of the monotonic clock]: commands pass without Python."""
        job = self.rig.job
        seen = (job.sequence, job.periods if self._lockstep else job.arrived)
        if seen != self._seen:
            self._seen, self._heard = seen, time.monotonic()
        return self._heard

    def _switch(self, what: int) -> None:
        rig, state = self.rig, self.rig.job.state
        if what == datagrams.ON and state == OFF:
            rig.switch_on()
            self._tell("on")
        elif what == datagrams.OFF and state == ON:
            rig.switch_off()
            if self._lockstep:
                rig.run_out()
            self._tell("off")
        elif what == datagrams.RESET and state == TRIPPED:
            try:
                rig.reset()
                self._tell("reset")
            except InputError as error:
                self._tell(f"cannot be reset: {error}")

    def _others(self) -> str:
        return f"{_named(self._owner)} commands this rig; another client is served when that one is gone"

    def _refuse(self, sender: Address, why: str) -> None:
        self._send(datagrams.REFUSAL, why.encode(), sender)

    def _send(self, kind: int, body: bytes, to: Address | None = None) -> None:
        """To the owner, or elsewhere; what cannot be sent is lost, as any datagram may be."""
        target = to or self._owner
        if target is None:
            return
        try:
            self._socket.sendto(datagrams.datagram(kind, body), socket.MSG_DONTWAIT, target)
        except OSError:
            self.rig.job.dropped += 1


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
    where.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", 0, _POLL))  # and still blocking
    try:
        where.bind((host, port))
    except (OSError, OverflowError) as error:
        where.close()
        what = error.strerror if isinstance(error, OSError) else "no such port"
        raise InputError(f"{host}:{port}: {what}; choose another port, or leave it out for a free one") from None
    return where


def _sender(raw: bytes) -> Address:
    """Host and port of an IPv4 address as the socket gave it."""
    return socket.inet_ntoa(raw[4:8]), int.from_bytes(raw[2:4], "big")


def _named(address: Address | None) -> str:
    return "nobody" if address is None else f"{address[0]}:{address[1]}"
