"""A P loop on a rig behind a wire, with nothing but Python's standard library and the page on the link (docs/wire.md).

jackbench serve jack-10t --lockstep --out out/serve      # prints udp://127.0.0.1:PORT
python examples/link/p_loop.py udp://127.0.0.1:PORT
"""

import json
import signal
import socket
import struct
import sys

MAGIC, TRIPPED = b"JBRIG\x01", 2
HELLO, RIG, COMMAND, READING, SWITCH, STATE, REFUSAL = range(7)
GAIN, STEP, SECONDS = 0.3, 0.01, 1.0  # 1/m, m, s
ENDS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

host, port = sys.argv[1].removeprefix("udp://").split(":")
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
line.connect((host, int(port)))
line.settimeout(0.2)


def ask(kind: int, body: bytes, wanted: int, sequence: int | None = None) -> bytes:
    """Send a datagram, again where nothing comes; the body of the answer, of a reading that of a sequence number."""
    for _ in range(20):
        line.send(MAGIC + bytes([kind]) + body)
        try:
            while True:
                data = line.recv(65536)
                got, answer = data[6:7], data[7:]
                if kind == HELLO and got == bytes([REFUSAL]):
                    sys.exit(f"the rig refuses: {answer.decode()}")
                fits = sequence is None or struct.unpack_from("<I", answer.ljust(5), 1)[0] == sequence
                if data[:6] == MAGIC and got == bytes([wanted]) and fits:
                    return answer
        except TimeoutError:
            continue
    sys.exit("the rig does not answer")


def stop(*_: object) -> None:
    """Ctrl-C, a kill, a closed terminal: the first of them ends the loop."""
    for each in ENDS:
        signal.signal(each, signal.SIG_IGN)
    sys.exit("interrupted")


def position() -> float:
    """In the last reading [m]."""
    return struct.unpack_from(f"<{len(channels)}d", reading, 13)[channels.index("position")]


rig = json.loads(ask(HELLO, b"", RIG))
channels, lockstep = [channel["name"] for channel in rig["channels"]], rig["mode"] == "lockstep"
for each in ENDS:
    signal.signal(each, stop)
try:
    reading = ask(SWITCH, b"\x01", READING, 0)
    start = position()
    for k in range(1, round(SECONDS / rig["period_s"]) + 1):
        command = GAIN * (start + STEP - position())
        reading = ask(COMMAND, struct.pack("<Id", k, command), READING, k if lockstep else None)
        if reading[0] & TRIPPED:
            sys.exit("the rig tripped")
finally:
    ask(SWITCH, b"\x00", STATE)  # the last word, whatever ended the loop
moved = position() - start
more = "" if moved > 0.98 * STEP else f"; it is on its way, as a gain of {GAIN:g} 1/m is small: raise it to be sooner"
print(f"{rig['rig']}, {rig['mode']}: moved {1e3 * moved:.3f} of {1e3 * STEP:g} mm in {SECONDS:g} s{more}")
