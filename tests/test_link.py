"""A rig behind a wire: the bytes are those of the loop in simulation, whatever gets lost; nobody else moves it."""

import math
import random
import struct
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_links import HEAD, Stranger, at, jack_bench, served

from controllers.p import P
from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.link import datagrams
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.datagrams import Reading
from workbench.link.hello import read_hello
from workbench.link.served_rig import ServedRig
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_loop import SampledLoop
from workbench.loop.sensors import logged
from workbench.plant import build
from workbench.rigs.platform import load_platform
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
LATE = with_delay(RIG, RIG.computing_delay.value)
GAIN, STEP, PERIODS = 3.0, 0.01, 200
finite = st.floats(allow_nan=False)


@given(st.integers(0, 2**32 - 1), st.lists(finite, max_size=8))
def test_commands_come_through(sequence, values):
    kind, body = datagrams.opened(datagrams.command(sequence, values)) or (None, b"")
    assert kind == datagrams.COMMAND
    assert datagrams.read_command(body) == (sequence, tuple(values))


@given(st.integers(0, 255), st.integers(0, 2**32 - 1), st.integers(0, 2**64 - 1), st.lists(finite, max_size=8))
def test_readings_come_through(status, sequence, tick, values):
    reading = Reading(status, sequence, tick, tuple(values))
    kind, body = datagrams.opened(datagrams.reading(reading)) or (None, b"")
    assert kind == datagrams.READING
    assert datagrams.read_reading(body) == reading


@given(st.binary(max_size=60))
def test_other_bytes_are_no_datagram(data):
    assert datagrams.opened(data) is None or data.startswith(HEAD)
    datagrams.read_command(data)
    datagrams.read_reading(data)


def test_the_bytes_are_those_that_the_link_lays_down():
    assert datagrams.command(7, (0.25,)) == b"JBRIG\x01\x02" + struct.pack("<Id", 7, 0.25)
    assert datagrams.datagram(datagrams.SWITCH, b"\x01") == b"JBRIG\x01\x04\x01"


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"rig": 1, "period_s": "x"}', "null", '"on"', "[" * 5000])
def test_a_hello_that_is_none_is_one_sentence(text):
    with pytest.raises(InputError, match="hello"):
        read_hello(text, "udp://127.0.0.1:1")


def simulated(periods=PERIODS, seed=3):
    """The readings [k, channels] and commands [k] of the workbench's own loop."""
    plant = build(LATE)
    loop = SampledLoop(
        Engine(plant), LATE, P(P.Design(gain=GAIN), RIG.period.value), equilibrium(plant), seed, compiled=False
    )
    run = loop.run(np.full(periods, STEP))
    readings = logged(run.record.signals, LATE, plant.outputs, seed)
    return np.column_stack(list(readings.values())), run.record.signals["command"]


def closed(client, before_each=lambda _: None, periods=PERIODS):
    """Readings [k, channels] of a P loop that a stranger closes on a rig that it has switched on."""
    rows, position = [], client.channel("position")
    for k in range(1, periods + 1):
        _, sequence, tick, values = client.reading()
        assert (sequence, tick) == (k - 1, k - 1)
        rows.append(values)
        client.command(k, GAIN * (STEP - values[position]))
        before_each(k)
    client.reading()
    return np.array(rows)


def test_a_strangers_loop_in_lockstep_is_the_simulation_to_the_byte():
    with served(jack_bench()) as server, Stranger(server) as client:
        hello = client.greet()
        assert (hello["rig"], hello["mode"], hello["state"], hello["period_s"]) == ("jack-10t", "lockstep", "off", 1e-3)
        assert hello["commands"] == [{"name": "command", "unit": "1", "low": -1.0, "high": 1.0}]
        assert {"name": "pa", "unit": "Pa"} in hello["channels"]
        assert hello["limits"]["position"] == [-0.24, 0.24]
        assert client.switch(1) == "on"
        rows = closed(client)
        assert client.switch(0) == "off"
    np.testing.assert_array_equal(rows, simulated()[0])


def test_lost_doubled_and_old_datagrams_change_nothing():
    random.seed(1)
    with served(jack_bench()) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)

        def disturb(k):
            again = GAIN * 0.5
            if random.random() < 0.3:
                client.command(k, again)  # doubled, with another value: it is answered by the same reading
                client.reading()
                reading = client.reading()
                assert reading[1] == k
                client.command(k, again)
            if random.random() < 0.3 and k > 2:
                client.command(k - 2, 1.0)  # late
                assert client.take(6).startswith(b"command ")
                client.command(k, 0.0)

        rows = closed(client, disturb)
    np.testing.assert_array_equal(rows, simulated()[0])


def test_the_workbenchs_client_asks_again_for_what_is_lost():
    with served(jack_bench()) as server, LinkClient(at(server)) as client:
        reading, rows = client.on(), []
        position = client.hello.names.index("position")
        for k in range(50):
            rows.append(reading.values)
            if k % 10 == 5:  # a command that does not arrive
                client._socket.send(b"noise")
            reading = client.exchange((GAIN * (STEP - reading.values[position]),))
    np.testing.assert_array_equal(rows, simulated(50)[0])


def test_a_second_client_is_refused_by_name_and_one_without_the_token_too():
    with served(jack_bench(), token="abc") as server, Stranger(server) as client, Stranger(server) as other:
        client.send(0, b"no")
        assert b"token" in client.take(6)
        client.greet(b"abc")
        client.switch(1)
        client.reading()
        other.send(0, b"abc")
        assert str(client.socket.getsockname()[1]).encode() in other.take(6)
        other.command(1, 1.0)
        assert b"commands this rig" in other.take(6)
        other.send(4, b"\x00")
        other.take(6)
        assert server.rig.state == "on"
        client.command(1, 0.0)
        assert client.reading()[1] == 1


def test_what_cannot_be_taken_is_refused_in_a_sentence_and_moves_nothing():
    with served(jack_bench()) as server, Stranger(server) as client:
        client.greet()
        client.command(1, 0.1)
        assert client.take(6) == b"the rig is off; switch it on first"
        client.switch(1)
        client.reading()
        for values, why in (((math.nan,), b"not finite"), ((math.inf,), b"not finite"), ((0.1, 0.2), b"19 bytes")):
            client.command(1, *values)
            assert why in client.take(6)
        client.command(5, 0.1)
        assert client.take(6) == b"command 5 is not the next one, 1"
        client.send(4, b"\x09")
        assert b"switch" in client.take(6)
        client.command(1, 0.1)
        assert client.reading()[1:3] == (1, 1)


def test_commands_are_limited_and_say_so():
    with served(jack_bench()) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)
        assert client.reading()[0] == datagrams.IS_ON
        client.command(1, 0.1)
        assert client.reading()[0] == datagrams.IS_ON
        client.command(2, 7.0)
        assert client.reading()[0] == datagrams.IS_ON | datagrams.LIMITED
        assert server.rig.command[0] == pytest.approx(0.1 + 0.2)  # the rate limit: 200 1/s
        client.command(3, 0.3)
        assert client.reading()[0] == datagrams.IS_ON


def test_a_rig_trips_at_its_stroke_answers_on_and_is_reset_where_it_stands():
    with served(jack_bench()) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)
        k, status, position = 0, datagrams.IS_ON, client.channel("position")
        while status & datagrams.IS_ON:
            _, _, _, values = client.reading()
            k += 1
            client.command(k, 0.3)
            status = struct.unpack_from("<B", client.socket.recv(2048, 2), 7)[0]  # a peek
            assert k < 1000
        assert status & datagrams.IS_TRIPPED
        assert client.reading()[1] == k
        for _ in range(400):
            k += 1
            client.command(k, 1.0)
            status, _, _, values = client.reading()
        assert status & datagrams.IS_TRIPPED
        assert server.rig.command[0] == 0
        assert server.rig.trip == "beyond its stroke"
        assert client.switch(1) == "tripped"
        assert client.switch(0) == "tripped"
        assert client.switch(2) == "off"
        assert client.switch(1) == "on"
        after = client.reading()
        assert after[1:3] == (0, 0)
        assert after[3][position] == pytest.approx(values[position], abs=2e-3)


def test_a_shut_off_valve_stops_a_tripped_rig():
    from workbench.rigs.shut_off import closing_in

    moved = []
    for rig in (RIG, replace(RIG, shut_off=closing_in(0.005))):
        own = ServedRig(bench(rig, True), 1)
        own.switch_on()
        while own.state == "on":
            own.demanded = (1.0,)
            own.step()
            own.sample()
        begun = own.outputs[own.bench.plant.output("position")]
        for _ in range(200):
            own.demanded = (1.0,)  # a valve that sticks: what is demanded goes on
            own.step()
        own.sample()
        moved.append(own.outputs[own.bench.plant.output("position")] - begun)
    assert moved[1] < moved[0]


def test_where_nothing_compiles_a_rig_is_served_by_the_interpreter():
    told = []
    for own in (jack_bench(), replace(jack_bench(), engine=Engine(jack_bench().plant, back_end="interpreted"))):
        rig = ServedRig(own, 1)
        rig.switch_on()
        for k in range(1, 6):
            rig.take(k, (0.05,))
            rig.step()
            rig.sample()
        told.append(rig.outputs)
    np.testing.assert_allclose(*told, rtol=1e-9, atol=1e-9)


def test_a_platform_is_served_with_six_commands():
    with served(bench(load_platform("hexapod"), True)) as server, Stranger(server) as client:
        hello = client.greet()
        assert [each["name"] for each in hello["commands"]] == [f"leg{i}.command" for i in range(1, 7)]
        client.switch(1)
        first = client.reading()[3]
        for k in range(1, 101):
            client.command(k, *(0.005,) * 6)
            last = client.reading()[3]
        legs = [client.channel(f"leg{i}.position") for i in range(1, 7)]
        assert all(last[leg] - first[leg] > 1e-3 for leg in legs)


def test_strange_datagrams_change_nothing_but_a_counter():
    """Some ten thousand here; FUZZ_LINK sets how many."""
    import os

    count = int(os.environ.get("FUZZ_LINK", "10000"))
    random.seed(2)
    with served(jack_bench()) as server, Stranger(server) as client, Stranger(server) as other:
        client.greet()
        client.switch(1)
        client.reading()
        client.command(1, 0.01)
        before = client.reading()
        x = server.rig.x.copy()
        good = HEAD + b"\x02" + struct.pack("<Id", 2, 0.5)
        for k in range(count):
            data = bytearray(good if k % 2 else random.randbytes(random.randrange(40)))
            if k % 2:
                data[random.randrange(6)] ^= 1 << random.randrange(8)  # no longer of this link, or of this version
            other.socket.send(bytes(data))
            if k % 100 == 0:
                time.sleep(0.002)  # what waits has room for so many
        client.command(1, 0.01)
        assert client.reading() == before
        assert server.dropped > 0.5 * count
        np.testing.assert_array_equal(server.rig.x, x)


def test_in_real_time_readings_come_by_themselves_and_the_watchdog_closes_the_valve():
    with served(jack_bench(computes=False), lockstep=False) as server, Stranger(server) as client:
        hello = client.greet()
        assert hello["mode"] == "realtime"
        client.switch(1)
        first = client.reading()
        assert first[2] == 0
        client.command(1, 0.02)
        seen = [client.reading() for _ in range(hello["watchdog_periods"] + 40)]
        ticks = [tick for _, _, tick, _ in seen]
        assert ticks == sorted(ticks)
        assert max(sequence for _, sequence, _, _ in seen) == 1
        assert seen[-1][0] & datagrams.WATCHDOG
        assert server.rig.command[0] == 0
        client.command(2, 0.0)
        until = time.monotonic() + 2.0
        while client.reading()[0] & datagrams.WATCHDOG:
            assert time.monotonic() < until
        client.switch(0)
        client.socket.setblocking(False)
        time.sleep(0.01)
        while not client.silent():
            pass


def reached(client, number):
    """Whether a command of this number has come to act within a second."""
    until = time.monotonic() + 1.0
    while time.monotonic() < until:
        if client.reading()[1] == number:
            return True
    return False


def test_in_real_time_a_command_of_an_old_session_is_refused_in_words_and_silences_no_new_one():
    with served(jack_bench(computes=False), lockstep=False) as server, Stranger(server) as client:
        client.greet()
        for old in (200, 2**31 - 1, 2**31, 2**32 - 1):
            client.switch(1)
            client.command(old, 0.5)
            assert client.take(6).startswith(b"old: command %d " % old)
            client.command(1, 0.0)
            assert reached(client, 1)
            client.switch(0)
        client.switch(1)
        client.command(100, 0.0)  # as many as may have been lost
        assert reached(client, 100)
        client.command(99, 0.5)
        assert client.take(6).startswith(b"old: command 99 comes after 100, ")
        assert server.rig.command[0] == 0.0


def test_in_real_time_a_session_goes_on_after_a_loss_and_past_the_last_number():
    with served(jack_bench(computes=False), lockstep=False) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)
        while client.reading()[2] < 100:
            pass
        last = 0
        for number, taken in ((65536, True), (65536 + 65537, False), (2**31 + 5, False), (65537, True)):
            client.command(number, 0.0)
            last = number if taken else last
            if not taken:
                assert client.take(6).startswith(b"old: command %d comes after %d" % (number, last))
            assert reached(client, last)
        server.rig.sequence = 2**32 - 2
        for number in (2**32 - 1, 0, 1):
            client.command(number, 0.0)
            assert reached(client, number)


def test_a_flood_of_old_commands_makes_no_rig_in_real_time_stand_still():
    """It may ask Python once a period, and so its clock and its watchdog go on."""
    with served(jack_bench(computes=False), lockstep=False) as server, Stranger(server) as client:
        client.greet()
        client.switch(1)
        client.command(5, 0.0)
        assert reached(client, 5)
        begun, first = time.monotonic(), server.rig.tick
        while time.monotonic() - begun < 0.5:
            for _ in range(20):
                client.command(4, 0.5)
            time.sleep(1e-4)
        periods = (time.monotonic() - begun) / RIG.period.value
        assert server.rig.tick - first > 0.8 * periods - 50
        assert server.rig.command[0] == 0.0


def test_the_workbenchs_client_counts_past_the_last_number():
    with served(jack_bench()) as server, LinkClient(at(server)) as client:
        client.on()
        server.rig.sequence = client._sequence = 2**32 - 2
        assert [client.exchange((0.0,)).sequence for _ in range(3)] == [2**32 - 1, 0, 1]


def test_a_client_that_has_switched_the_rig_off_makes_room_at_once():
    with served(jack_bench()) as server, Stranger(server) as client, Stranger(server) as other:
        client.greet()
        client.switch(1)
        client.switch(0)
        assert client.switch(1) == "on"
        client.switch(0)
        assert other.greet()["state"] == "off"
        assert other.switch(1) == "on"
        client.send(4, b"\x00")
        client.take(6)
        assert server.rig.state == "on"
