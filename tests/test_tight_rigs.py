"""Live rigs that are tighter than their file: what joins them keeps inside their limits, and says whose each one is."""

import json
from dataclasses import replace
from html import unescape
from io import StringIO

import numpy as np
import pytest
from made_links import at, jack_bench, served

from controllers.p import P
from workbench.base import trust
from workbench.base.errors import InputError
from workbench.cli import main
from workbench.commands.commission import results, study
from workbench.commands.common.limits_told import limits_json, limits_section
from workbench.control.controller_type import controller
from workbench.control.protocol import graph_law
from workbench.link import datagrams
from workbench.link.bench import bench
from workbench.link.client import LinkClient
from workbench.link.commissioning import allowed, designs
from workbench.link.course import play_course
from workbench.link.hello import Channel, CommandRange, Hello
from workbench.link.joined import joined
from workbench.link.wire_loop import WireLoop, stands
from workbench.loop.guarded_controller import Guard
from workbench.rigs.limited import BY_DEFAULT, HELLO, SignalLimit, limits_of, whose
from workbench.rigs.number import Number
from workbench.rigs.rig_file import load_rig, rig_text
from workbench.rigs.schema import LIMITS

RIG = load_rig("jack-10t")
BAR = 1e5


def limited(**limits):
    """The rig with other limits, SI."""
    own = {name: Number(name, value, LIMITS[name].unit, LIMITS[name].unit, "") for name, value in limits.items()}
    return replace(RIG, limits={**RIG.limits, **own})


TIGHT = {"a fifth of the speed": limited(speed=RIG.limit("speed") / 5), "250 bar": limited(pressure=250 * BAR)}
LARGEST = {"a fifth of the speed": ("velocity", 1.0), "250 bar": ("pa", 250 * BAR)}


@pytest.fixture(params=TIGHT)
def tight(request):
    """A server of a tight rig, and the signal that is limited with its limit."""
    with served(bench(TIGHT[request.param], True)) as server:
        yield server, *LARGEST[request.param]
        assert server.trips == 0
        assert server.rig.state == "off"


def left_by(tight, tmp_path, *words, file="metrics.json"):
    """What a command leaves that joins a tight rig, and that its page says whose the limit is."""
    server, _, value = tight
    assert main([*words, "--at", at(server), "--out", str(tmp_path / "out")]) == 0
    told = json.loads((tmp_path / "out" / file).read_text())
    assert (told["trips"], told["tripped"], told["ended"]) == (0, [], None)
    assert {"limit": "speed" if value == 1.0 else "pressure", "value": value, "unit": "m/s" if value == 1.0 else "Pa",
            "whose": HELLO} in told["limits"]  # fmt: skip
    page = unescape((tmp_path / "out/report.html").read_text())
    assert HELLO in page
    return told, page


FAST = """
experiment = "step"
rig = "jack-10t"
scenarios = ["position-10mm", "position-sine-5hz", "position-100mm"]
[controllers.fast]
use = "controllers.p:P"
gain = {value = 12, unit = "1/m"}
[[controllers.fast.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = {value = 2.15e-4, unit = "1/bar"}
corner = {value = 0.25, unit = "Hz"}
[bode]
low_hz = 0.5
high_hz = 30
points = 3
amplitudes_mm = [10]
"""


def test_drive_refuses_what_is_foreseen_beyond_a_limit_and_plays_the_rest(tight, tmp_path):
    (tmp_path / "fast.toml").write_text(FAST)
    told, page = left_by(tight, tmp_path, "drive", str(tmp_path / "fast.toml"))
    refused = {each["scenario"]: each["why"] for each in told["refused"]}
    assert "position-100mm" in refused
    assert any(word in refused["position-100mm"] for word in ("1 m/s", "250 bar"))
    assert "position-sine-5hz" in [row["scenario"] for row in told["rows"]]
    assert "position-100mm was not played: " in page


def test_drive_with_nothing_left_to_play_is_one_line_and_moves_nothing(tight, tmp_path, capsys):
    server, *_ = tight
    (tmp_path / "fast.toml").write_text(FAST.replace('"position-10mm", "position-sine-5hz", ', ""))
    assert main(["drive", str(tmp_path / "fast.toml"), "--at", at(server), "--out", str(tmp_path / "out")]) == 2
    assert "so nothing moved" in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_record_plays_the_standard_set_as_large_as_the_rig_takes_it(tight, tmp_path):
    """Also where a multisine ends in full motion: it is that end that shakes the jack most."""
    told, _ = left_by(tight, tmp_path, "record", "jack-10t")
    assert [row["record"] for row in told["rows"]] == ["steps", "triangle", "multisine"]


def test_commission_never_trips_it(tight, tmp_path, monkeypatch):
    """All that is played before a trace: looks, records, and steps of the law by rules and of the datasheet's."""
    monkeypatch.setattr(designs, "DESIGNS", 2)
    monkeypatch.setattr(allowed, "DRAWN", 4)
    monkeypatch.setattr(study, "STEPS", ("position-100mm",))
    monkeypatch.setattr(study, "_rounds", lambda *_: ([], None))
    monkeypatch.setattr(results, "STEPS", ("position-10mm",))
    told, page = left_by(tight, tmp_path, "commission", "jack-10t", "--jobs", "1", file="commission.json")
    assert {row["way"] for row in told["rows"]} == {"automatic", "datasheet", "limit"}
    for each in told["smaller"]:
        assert "is foreseen" in each["why"]
        assert each["why"] in page
    found = load_rig(tmp_path / "out/found.toml")
    assert found.limit("speed" if tight[2] == 1.0 else "pressure") == tight[2]


def hello(**changes):
    told = {
        "rig": "other", "period": 1e-3, "lockstep": True, "commands": (CommandRange("command", "1", -1.0, 1.0),),
        "channels": tuple(Channel(name, "") for name in RIG.sensors), "watchdog_periods": 50,
        "limits": {}, "state": "off",
    }  # fmt: skip
    return Hello(**(told | changes))


def test_of_file_and_hello_the_tighter_one_is_taken_signal_by_signal():
    limits = {
        "position": (-0.2, 0.3),
        "velocity": (-1.2, 1.2),
        "force": (-2e5, 2e5),
        "pa": (0.0, 3e7),
        "pb": (1e5, 2.9e7),
    }
    commands = (CommandRange("command", "1", -0.5, 0.8),)
    channels = tuple(Channel(name, "") for name in ("position", "pa", "unheard"))
    rig = joined(RIG, hello(limits=limits, commands=commands, channels=channels, period=2e-3))
    names = ("stroke", "speed", "force", "pressure", "least_pressure", "command")
    assert [rig.limit(name) for name in names] == [0.2, 1.2, RIG.limit("force"), 2.9e7, 1e5, 0.5]
    assert (rig.period.value, set(rig.sensors)) == (2e-3, {"position", "pa"})
    assert [whose(rig.limits[name]) for name in ("stroke", "speed")] == [HELLO, HELLO]
    assert whose(rig.limits["force"]).startswith("the rig file: ")
    assert joined(rig, hello(period=2e-3)).limits == rig.limits


def test_without_a_number_a_chamber_may_have_1_3_times_the_supply_and_a_hello_s_own_comes_first():
    rig = joined(RIG, hello())
    assert (rig.limit("pressure"), whose(rig.limits["pressure"])) == (1.3 * RIG["Ps"], BY_DEFAULT)
    assert joined(RIG, hello(limits={"pa": (0.0, 3e7)})).limit("pressure") == 3e7
    assert joined(limited(pressure=2e7), hello(limits={"pa": (0.0, 3e7)})).limit("pressure") == 2e7


def test_limits_of_a_joined_rig_are_a_rig_file(tmp_path):
    rig = replace(
        joined(RIG, hello(limits={"pa": (0.0, 3e7)}, commands=(CommandRange("c", "1", -0.5, 0.5),))), name="rig"
    )
    (tmp_path / "rig.toml").write_text(rig_text(rig))
    assert limits_of(load_rig(tmp_path / "rig.toml")) == limits_of(rig)


def test_a_hello_without_room_is_one_line():
    with pytest.raises(InputError, match="no room about rest"):
        joined(RIG, hello(limits={"position": (0.1, 0.3)}))


def test_a_guard_keeps_pressure_and_range_of_the_command():
    guard = Guard(joined(RIG, hello(limits={"pa": (0.0, 2e7)}, commands=(CommandRange("c", "1", -0.5, 0.5),))))
    sent = [0.0]
    for k in range(5):
        guard.watch({"position": 0.0, "pa": 1.4e7 + 1e6 * k, "pb": 1e7})
        sent.append(guard.limit(1.0))
    assert guard.tripped is None
    assert max(sent) == 0.5
    guard.watch({"position": 0.0, "pa": 1.95e7, "pb": 1e7})  # at the next sample it would be beyond
    assert guard.tripped == f"pressure of a chamber beyond 0 bar to 200 bar ({HELLO})"


def test_limits_on_further_signals_are_kept_where_they_are_measured_and_said_where_they_are_not():
    told = {
        "current": (-0.01, 0.01),
        "supply": (1.9e7, 2.3e7),
        "jack_force": (-5e4, 5e4),
        "oil": (5.0, 60.0),
        "tank": (0.0, 1.0),
    }
    rig = joined(RIG, hello(limits=told, channels=tuple(Channel(name, "") for name in (*RIG.sensors, "oil"))))
    assert all(limit.ends == pytest.approx(told[limit.signal]) for limit in rig.further_limits)
    assert dict.fromkeys(("current", "supply"), HELLO) | {
        "jack_force": f"{HELLO}; not measured: foreseen, and the rig keeps it itself",
        "oil": f"{HELLO}; watched, not foreseen here",
        "tank": f"{HELLO}; the rig keeps this itself, and it is not foreseen here",
    } == {limit.signal: limit.whose for limit in rig.further_limits}
    assert {"limit": "least_supply", "value": 1.9e7, "unit": "Pa", "whose": HELLO} in limits_json(rig)
    (table,) = limits_section(rig).items
    assert ["least supply", 190.0, "bar", HELLO] in table.rows
    with pytest.raises(InputError, match="supply from 2 to 1, no room"):
        joined(RIG, hello(limits={"supply": (2.0, 1.0)}))


def test_a_supply_that_stands_near_its_limit_is_foreseen_to_stay_there():
    """No motion of a rig with a supply that is stiff moves it; what is left of the limit is counted from rest."""
    rig = joined(RIG, hello(limits={"supply": (0.0, 1.04 * RIG["Ps"])}))
    assert allowed.allowed(rig).trouble(controller("controllers.p:P", gain=2.0), np.full(300, 1e-3), 0.0) is None


@pytest.fixture(scope="module")
def shaken():
    """A rig that trips by acceleration too, and tells that: 10 mm are inside as declared, and beyond at its bounds."""
    own = bench(RIG, True)
    return replace(own, limits=(*own.limits, SignalLimit("acceleration", 0.0, 105.0)))


def test_drive_foresees_over_the_bounds_and_names_the_plant_that_binds(shaken, tmp_path):
    text = FAST.replace('"position-10mm", "position-sine-5hz", "position-100mm"', '"position-1mm", "position-10mm"')
    (tmp_path / "fast.toml").write_text(text)
    with served(shaken) as server:
        assert main(["drive", str(tmp_path / "fast.toml"), "--at", at(server), "--out", str(tmp_path / "out")]) == 0
        assert server.trips == 0
    told = json.loads((tmp_path / "out/metrics.json").read_text())
    assert [row["scenario"] for row in told["rows"]] == ["position-1mm"]
    (refused,) = told["refused"]
    assert refused["scenario"] == "position-10mm"
    assert f"of -105 m/s2 ({HELLO}) is foreseen with M 900 kg, beta 8.5e+08 Pa, Ps " in refused["why"]
    assert {"limit": "acceleration", "value": 105.0, "unit": "m/s^2", "whose": HELLO} in told["limits"]
    assert refused["why"] in unescape((tmp_path / "out/report.html").read_text())


def test_a_guard_keeps_a_further_limit_before_the_rig_trips_and_names_it(shaken):
    """The motion was not foreseen."""
    with served(shaken) as server, LinkClient(at(server)) as client:
        rig = joined(RIG, replace(client.hello, limits={**client.hello.limits, "acceleration": (-20.0, 20.0)}))
        played = play_course(client, rig, plain(1.0), np.full(200, 0.05), 0.0, name="a step")
        assert server.trips == 0
        assert server.rig.state == "off"
    trip = played.trip
    assert (trip.by, trip.limit, trip.whose, trip.motion) == ("guard", "acceleration", HELLO, "a step")
    assert abs(trip.value) == 20.0
    assert f"acceleration beyond -20 m/s2 to 20 m/s2 ({HELLO}); acceleration was" in trip.words
    assert abs(played.run.rows[-1][2]) <= RIG.limit("command_rate") * RIG.period.value  # down by the guard's ramp


def test_a_law_that_computes_in_python_is_foreseen_at_the_ends_of_the_bounds_too(tmp_path):
    mine = "class Mine(P):\n    def update(self, realised):\n        super().update(realised)\n"
    (tmp_path / "mine.py").write_text(f"from controllers.p import P\n\n{mine}")
    trust.allow(tmp_path / "mine.py")
    rig = joined(RIG, hello(limits={"acceleration": (-54.0, 54.0)}))
    plants = allowed.allowed(rig)
    own = replace(plants, p=plants.p[:1], drawn=plants.drawn[:1])
    laws = [controller(f"{use}", gain=1.0) for use in ("controllers.p:P", f"{tmp_path}/mine.py:Mine")]
    assert graph_law(laws[1].build(1e-3)) is None
    course = np.full(300, 0.05)
    assert [own.trouble(law, course, 0.0) for law in laws] == [None, None]
    assert all("is foreseen with M " in plants.trouble(law, course, 0.0) for law in laws)


def plain(gain=2.0):
    return P(P.Design(gain=gain), RIG.period.value)


def test_a_trip_of_the_rig_says_what_was_nearest_when_and_in_which_motion():
    """Its limit is not the one that its hello tells: no client can foresee that."""
    with served(bench(limited(speed=0.1), True)) as server, LinkClient(at(server)) as client:
        rig = joined(RIG, replace(client.hello, limits={"velocity": (-0.17, 0.17)}))
        played = play_course(client, rig, plain(), np.linspace(0.0, 0.1, 800), 0.0, name="a ramp")
        assert server.trips == 1
    trip = played.trip
    assert (trip.by, trip.limit, trip.value, trip.whose, trip.motion) == ("rig", "velocity", 0.17, HELLO, "a ramp")
    assert 0.07 < trip.reading < 0.12
    assert trip.words in played.ended
    assert "it does not say why; nearest to its limit was velocity" in trip.words
    assert played.run.record.t[0] <= trip.t <= played.run.record.t[-1]
    assert played.mark == pytest.approx(trip.t + played.record.t[-1] - played.run.record.t[-1])


def test_a_trip_of_the_guard_says_limit_value_and_reading_in_metrics_on_the_page_and_in_the_figure(tmp_path):
    """The rig's supply is far above its file's: what is foreseen does not come."""
    (tmp_path / "fast.toml").write_text(
        FAST.replace(', "position-sine-5hz", "position-100mm"', "").replace("12", "3.7")
    )
    (tmp_path / "rig.toml").write_text(rig_text(replace(limited(pressure=190 * BAR), name="rig")))
    with served(bench(RIG.with_values(Ps=315 * BAR), True)) as server:
        words = ["drive", str(tmp_path / "fast.toml"), "--rig", str(tmp_path / "rig.toml"), "--at", at(server)]
        assert main([*words, "--out", str(tmp_path / "out")]) == 0
        assert server.trips == 0
    told = json.loads((tmp_path / "out/metrics.json").read_text())
    (trip,) = told["tripped"]
    assert (told["trips"], trip["by"], trip["value"], trip["whose"]) == (1, "guard", 190 * BAR, "the rig file")
    assert trip["limit"] in ("pa", "pb")
    assert trip["reading"] > 180 * BAR
    assert "fast, position-10mm" in trip["motion"]
    page = (tmp_path / "out/report.html").read_text()
    assert "the guard tripped" in page
    assert "trip</" in page or '"trip"' in page


def test_after_a_trip_the_next_motion_waits_until_the_rig_stands_inside_its_limits():
    with served(jack_bench()) as server, LinkClient(at(server)) as client:
        rig = joined(RIG, client.hello)
        loop = WireLoop(client, rig, plain())
        loop.run(np.zeros(20))
        server.rig.stop(1)
        assert "nearest" in loop.run(np.zeros(20)).ended
        pressure = server.rig.x[server.rig.bench.plant.state("P1")]
        stand = stands(client, rig)
        assert stand.tick >= 100  # a tenth of a second that it was looked at
        assert not stand.tripped
        assert client.exchange((0.0,)).tick == stand.tick + 1
        client.off()
        tight = replace(rig, limits={**rig.limits, "pressure": replace(rig.limits["pressure"], value=0.5 * pressure)})
        with pytest.raises(InputError, match=r"does not come back inside its limits: p[ab] .* bar"):
            stands(client, tight)
        client.switch(datagrams.OFF)


@pytest.mark.parametrize("side", [-1, 1])
def test_near_the_end_of_the_stroke_a_step_out_is_refused_and_one_back_is_played(side, tmp_path):
    from workbench.linear import equilibrium

    steps = "".join(
        f'[scenario.{name}]\nsignal = "position"\nsize = {{value = {size}, unit = "mm"}}\n'
        'seconds = {value = 1, unit = "s"}\n'
        for name, size in (("out", side * 30), ("back", -side * 10))
    )
    text = FAST.replace('"position-10mm", "position-sine-5hz", "position-100mm"', '"out", "back"')
    (tmp_path / "fast.toml").write_text(text.replace("[bode]", f"{steps}[bode]"))
    with served(jack_bench()) as server:
        away = equilibrium(server.rig.bench.plant, position=side * 0.22)
        server.rig.put_at(away.x, away.u)
        assert main(["drive", str(tmp_path / "fast.toml"), "--at", at(server), "--out", str(tmp_path / "out")]) == 0
        assert server.trips == 0
    told = json.loads((tmp_path / "out/metrics.json").read_text())
    assert [each["scenario"] for each in told["refused"]] == ["out"]
    assert "240 mm" in told["refused"][0]["why"]
    assert [row["scenario"] for row in told["rows"]] == ["back"]


class Late(LinkClient):
    """A client that takes one reading in six."""

    def exchange(self, values):
        for _ in range(5):
            super().exchange(values)
        return super().exchange(values)


def test_late_readings_do_not_let_a_rig_of_little_speed_trip_before_its_guard():
    """The motion was not foreseen: the guard alone has to stop it, on one reading in six."""
    with served(bench(limited(speed=0.5), True)) as server, Late(at(server)) as client:
        played = play_course(client, joined(RIG, client.hello), plain(6.0), np.full(200, 0.15), 0.0)
        assert server.trips == 0
    assert (played.trip.by, played.trip.limit, played.trip.whose) == ("guard", "velocity", HELLO)


TWO_STAGE = {
    "Ps": "210 bar", "Pr": "2 bar", "flow": "40 l/min", "drop": "70 bar", "n": "1", "leakage": "1 l/min",
    "leakage drop": "210 bar", "amplitude": "100 %", "reference": "5 Hz", "f3db": "60 Hz", "f90": "80 Hz",
    "AA": "20 cm^2", "AB": "10 cm^2", "S": "500 mm", "M": "200 kg",
}  # fmt: skip


def test_where_rules_make_no_stable_law_the_slow_loop_of_the_drive_plays(tmp_path, monkeypatch):
    """On a rig as `new --ask` writes it: a light, quick jack, whose mode small moves do not show."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", StringIO("\n".join(("differential", *TWO_STAGE.values())) + "\n"))
    assert main(["new", "mine", "--ask", "two-stage"]) == 0
    monkeypatch.setattr(study, "_played", recorded := Recorded())
    rig = load_rig("mine/rig.toml")
    with served(bench(rig, True)) as server:
        with pytest.raises(Recorded.Done):
            main(["commission", "mine/rig.toml", "--at", at(server), "--out", "out"])
        assert server.trips == 0
    plants = allowed.allowed(joined(rig, hello(channels=tuple(Channel(name, "") for name in rig.sensors))))
    kept = plants.stable(recorded.law).p
    np.testing.assert_array_equal(kept[0], plants.p[0])  # that of the datasheet
    assert len(kept) > 0.9 * len(plants.p)
    assert [wave.name for wave in recorded.waves] == ["steps", "triangle", "multisine"]


class Recorded:
    """Takes what is about to be played, and ends there."""

    class Done(Exception):
        pass

    def __call__(self, _, waves, law, __):
        self.waves, self.law = waves, law
        raise self.Done
