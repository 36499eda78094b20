"""The workbench's end of the link: greets a rig, switches it, sends commands and takes readings."""

import re
import socket
import time
from collections.abc import Sequence
from contextlib import suppress

from ..base.errors import InputError, LinkLost
from . import datagrams
from .datagrams import Reading
from .hello import Hello, read_hello

_PLACE = re.compile(r"udp://([^/:\s]+):(\d{1,5})")
_TRIES, _PATIENCE = 20, 0.1  # s: how often something is asked again, and after how long
_READINGS_LOST = 10  # periods without a reading, and at least _PATIENCE: the link is lost


class LinkClient:
    """One rig at udp://HOST:PORT, greeted with a token. Raises InputError where nobody answers or one refuses."""

    def __init__(self, at: str, token: str = "") -> None:
        self.at = at
        place = _place(at)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.connect(place)
        except OSError as error:
            self._socket.close()
            raise InputError(f"--at {at}: {error.strerror or error}; check host and port") from None
        self._sequence = 0
        self.passed: list[Reading] = []  # that came before the newest one, and were not answered
        self.latest: Reading | None = None  # for those who look on
        self.asked = (0.0, 0.0)  # reference and command, of a loop at this rig
        self.stays_on = False  # between courses, in lockstep, where no time passes then
        self._is_on = self.was_reset = False  # the latter: at the last switch-on, after a trip
        self._switched_on = False
        self._token = token.encode()
        try:
            self.hello = self._greet()
        except InputError:
            self._socket.close()
            raise

    def __enter__(self) -> "LinkClient":
        return self

    def __exit__(self, *_: object) -> None:
        """However it ends, the rig that it has switched on is switched off."""
        if self._switched_on:
            self.off()
        self._socket.close()

    def switch(self, what: int) -> str:
        """Switch the rig: datagrams.ON, OFF or RESET; its state after that. Raises LinkLost."""
        return self._asked(datagrams.SWITCH, bytes([what]), datagrams.STATE, "a switch").decode(errors="replace")

    def on(self) -> Reading:
        """Switch it on, after a reset where it had tripped; the reading of tick 0, or the last one of a rig that stayed
        on. Raises InputError, LinkLost."""
        if self._is_on and self.latest is not None and not self.latest.tripped:
            return self.latest
        state = self._asked(datagrams.HELLO, self._token, datagrams.RIG, "a hello").decode(errors="replace")
        self.was_reset = read_hello(state, self.at).state == "tripped"
        if self.was_reset:
            self.switch(datagrams.RESET)
        self._switched_on = True
        if self.switch(datagrams.ON) != "on":
            raise InputError(f"{self.at}: the rig cannot be switched on; look at what stopped it")
        self._sequence, self.asked = 0, (0.0, 0.0)
        for _ in range(_TRIES):
            reading = self._reading(_PATIENCE)
            if reading is not None and reading.sequence == 0:
                self._is_on = self.stays_on and self.hello.lockstep
                return reading
            if reading is None and self.hello.lockstep:
                self._send(datagrams.datagram(datagrams.SWITCH, bytes([datagrams.ON])))
        raise LinkLost("no reading came after the rig was switched on")

    def off(self) -> None:
        """Switch it off; a rig that no longer answers has its watchdog."""
        self._is_on = False
        with suppress(LinkLost):
            self.switch(datagrams.OFF)
        self._switched_on = False

    def rest(self) -> None:
        """The end of a course: switch it off, unless it stays on."""
        if not self._is_on:
            self.off()

    def exchange(self, values: Sequence[float]) -> Reading:
        """Send a command; the next reading. In lockstep what was lost is asked for again. Raises LinkLost."""
        number = (self._sequence + 1) % 2**32
        packet, self.asked = datagrams.command(number, values), (self.asked[0], values[0])
        self._send(packet)
        self._sequence = number  # now, so that a number that an interrupt keeps from being sent is the next one's
        if not self.hello.lockstep:
            reading = self._reading(max(_PATIENCE, _READINGS_LOST * self.hello.period))
            if reading is None:
                raise LinkLost("no reading comes any more")
            return self._newest(reading)
        for _ in range(_TRIES):
            reading = self._reading(_PATIENCE)
            if reading is None:
                self._send(packet)
            elif reading.sequence == self._sequence:
                return reading
        raise LinkLost(f"no answer to command {self._sequence}")

    @property
    def sequence(self) -> int:
        """Number of the command that was sent last since the rig was switched on; 0 before the first."""
        return self._sequence

    def _newest(self, reading: Reading) -> Reading:
        """The last of the readings that wait: who is late answers what is now."""
        waiting = [reading]
        while (more := self._reading(0.0)) is not None:
            waiting.append(more)
        newest = max(waiting, key=lambda each: each.tick)
        self.passed = [each for each in waiting if each.tick < newest.tick]
        return newest

    def _greet(self) -> Hello:
        try:
            body = self._asked(datagrams.HELLO, self._token, datagrams.RIG, "a hello")
        except LinkLost:
            raise InputError(f"--at {self.at}: no rig answers there; check the address, and the rig") from None
        return read_hello(body.decode(errors="replace"), self.at)

    def _asked(self, kind: int, body: bytes, answer: int, what: str) -> bytes:
        """The body of the answer to a datagram, which is sent again until it comes. Raises InputError for a refusal."""
        for _ in range(_TRIES):
            self._send(datagrams.datagram(kind, body))
            until = time.monotonic() + _PATIENCE
            while (left := until - time.monotonic()) > 0:
                got = self._received(left)
                if got is None:
                    break
                if got[0] == answer:
                    return got[1]
                if got[0] == datagrams.REFUSAL and kind == datagrams.HELLO:
                    raise InputError(f"--at {self.at}: the rig refuses: {got[1].decode(errors='replace')}")
        raise LinkLost(f"no answer to {what}")

    def _reading(self, patience: float) -> Reading | None:
        """The next reading that is one, within so many seconds."""
        until = time.monotonic() + patience
        while True:
            got = self._received(max(0.0, until - time.monotonic()))
            if got is None:
                return None
            if got[0] == datagrams.READING:
                reading = datagrams.read_reading(got[1])
                if reading is not None and len(reading.values) == len(self.hello.channels):
                    self.latest = reading
                    return reading

    def _received(self, patience: float) -> tuple[int, bytes] | None:
        """Kind and body of the next datagram of the link, within so many seconds."""
        self._socket.settimeout(patience)
        try:
            while True:
                if opened := datagrams.opened(self._socket.recv(datagrams.LARGEST)):
                    return opened
        except (TimeoutError, BlockingIOError, ConnectionError):
            time.sleep(min(patience, 0.001))  # a closed port says so at once
            return None

    def _send(self, packet: bytes) -> None:
        try:
            self._socket.send(packet)
        except OSError:
            return  # as if it were lost on the way


def _place(at: str) -> tuple[str, int]:
    match = _PLACE.fullmatch(at)
    if match is None or not 0 < int(match[2]) < 65536:
        raise InputError(f"--at {at}: write udp://HOST:PORT, such as udp://127.0.0.1:5005")
    return match[1], int(match[2])
