"""A served rig paced by its client, and one paced by the clock."""

import select
import socket
import time

from . import datagrams
from .rig_server import RigServer
from .served_rig import OFF, ON

_AT_HAND = getattr(socket, "MSG_DONTWAIT", 0)  # which Windows does not have
_SPIN = 200_000 if _AT_HAND else 0  # ns that a server in lockstep looks for a command awake: to be woken takes as long
_AT_ONCE = 8  # datagrams that are still heard at an instant
_NUMBERS = 2**32  # of sequences
_AHEAD, _SESSION = 65_536, 100  # how far a command may be ahead; until when and how far one is of an old session


class LockstepServer(RigServer):
    """Each command moves the rig on by one period and is answered with the reading after it."""

    mode = "lockstep"
    _waits = True

    def _turn(self) -> None:
        until = time.perf_counter_ns() + _SPIN
        while (came := self._receive(_AT_HAND)) is None and time.perf_counter_ns() < until:
            pass
        if came or (came := self._receive()):
            self._hear(*came)

    def _take(self, sequence: int, values: tuple[float, ...]) -> str:
        rig = self.rig
        if sequence != rig.sequence:
            if sequence != (due := (rig.sequence + 1) % _NUMBERS):
                return f"command {sequence} is not the next one, {due}"
            rig.take(sequence, values)
            rig.step()
            rig.flags = datagrams.LIMITED * rig.limited
            rig.tick += 1
            self.periods += 1
            rig.sample()
        self._answer()
        return ""


class RealTimeServer(RigServer):
    """Readings go out at the instants of this machine's clock; the newest command that has come acts."""

    mode = "realtime"
    _waits = False
    _arrived: int | None = None  # ns: when the command came that is to act from the next instant on
    _now = _silent = 0  # ns: when the datagram came that is heard; periods without a command
    _waited = 0  # datagrams heard since an instant is due
    _overtaken = False  # an older command came after a newer one
    _asked = _refused = -1  # the periods in which a stranger was heard, and an old command refused

    def _turn(self) -> None:
        left = max(self.pace.left(), 0.0)
        if self._waited < _AT_ONCE and select.select((self._socket,), (), (), left)[0]:
            self._waited += not left
            self._now = time.perf_counter_ns() if left else self.pace.due
            if came := self._receive():
                self._hear(*came)
        else:
            self._waited = 0
            self._instant()

    def _instant(self) -> None:
        """One period: the reading goes out, and that of the next instant is made, since all that acts until then is
        known."""
        rig = self.rig
        if rig.condition == OFF:
            rig.flags = 0
        else:
            rig.flags = datagrams.LIMITED * rig.limited | self._promptness()
            self._answer()
            self.pace.meet()
            rig.tick += 1
        if rig.condition != ON:
            rig.release()
        rig.step()
        rig.sample()
        self.periods += 1
        self.pace.go_on()

    def _promptness(self) -> int:
        """Bits of the status, for a command that came, or for none: then the watchdog waits."""
        if self._arrived is not None:
            self.ages.add(self.pace.due - self._arrived)
            bits = datagrams.LATE * self._overtaken
            self._arrived, self._silent, self._overtaken = None, 0, False
            return bits
        self._silent += 1
        bits = datagrams.LATE * (self.rig.sequence != 0)
        if self._silent < self.watchdog:
            return bits
        self.rig.release()
        return bits | datagrams.WATCHDOG

    def _take(self, sequence: int, values: tuple[float, ...]) -> str:
        rig, ahead = self.rig, (sequence - self.rig.sequence) % _NUMBERS
        is_newer = 0 < ahead < _NUMBERS // 2
        is_old_session = rig.tick < _SESSION < sequence - rig.tick
        if is_newer and ahead <= _AHEAD and not is_old_session:
            rig.take(sequence, values)
            self._arrived = self._now
            return ""
        self._overtaken |= not is_newer
        if self._refused == self.periods:
            self.dropped += 1
            return ""
        self._refused = self.periods
        when = f'command {sequence} comes after {rig.sequence}, {rig.tick} periods after "on"'
        return f"old: {when}; a session counts its commands one by one, from 1 on"

    def _switch(self, what: int) -> None:
        if self.rig.condition == OFF:
            self._arrived, self._silent, self._overtaken = None, 0, False
        super()._switch(what)

    def _has_time(self) -> bool:
        """Once a period."""
        had, self._asked = self._asked, self.periods
        return had != self.periods
