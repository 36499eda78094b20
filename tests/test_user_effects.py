"""Effects that a user writes: read from files beside the rig, used like those of the library, their mistakes told."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.plant import build
from workbench.plant.effects import find, known_effects, load_effects, missing, resolve
from workbench.rigs.rig_file import load_rig, save_rig

DRAG = '''
"""Effects of our rig."""
from workbench.plant.effects import effect, number

@effect(
    "my.drag",
    "quadratic",
    equation="force",
    slot="body_force",
    source="our own",
    shows="fast moves",
    numbers=(number("c", 400.0, "N s^2/m^2", low=0.0, high=1e5, off=0.0, meaning="drag"),),
)
def drag(force, s):
    """F = c v |v|."""
    v = s["velocity"]
    return force + s.p("c") * v * abs(v)
'''
STATEFUL = """
import casadi as ca
from workbench.plant.effects import effect, number, state

def swept(motion, s):
    return motion[0] - s.x("y"), motion[1]

@effect("my.rod", "soft", equation="force", slot="acceleration", also={"piston": swept}, source="our own",
        shows="fast moves", states=(state("y", "m", 1e-4),),
        numbers=(number("c", 1e-9, "m/N", shown="um/kN", low=0.0, high=1e-7, off=0.0, meaning="compliance"),))
def rod(acceleration, s):
    s.rate("y", (s.p("c") * s["rod_force"] - s.x("y")) / 1e-3)
    return acceleration

@effect("jack.friction", "mine", equation="force", slot="friction", source="our own", shows="all")
def mine(friction, s):
    return friction + 100.0 * ca.tanh(s["velocity"] / 0.01)
"""


@pytest.fixture
def written(tmp_path):
    """A file of effects with some text, and its path."""

    def write(text, name="mine.py"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def with_files(tmp_path, rig):
    """The 10 t rig with more text at its head or end, read from a file."""

    def changed(head="", end=""):
        save_rig(rig, tmp_path / "rig.toml")
        text = (tmp_path / "rig.toml").read_text(encoding="utf-8")
        (tmp_path / "rig.toml").write_text(f"{head}\n{text}\n{end}", encoding="utf-8")
        return load_rig(tmp_path / "rig.toml")

    return changed


def test_a_user_s_effect_acts_as_it_says(written, with_files, rig, plant, rest):
    written(DRAG)
    uses = '[[effects]]\nname = "my.drag"\nc = {value = 0.2, unit = "kN s^2/m^2"}'
    own = with_files('effect_files = ["mine.py"]', uses)
    dragged = build(own)
    assert dragged.p[dragged.parameters.index("my.drag.c")] == 200.0
    x, u = rest.x.copy(), np.zeros(len(plant.inputs))
    for v in (2.0, -3.0):
        x[plant.state("v")] = v
        rates = [np.array(p.f(x, u, p.p)).ravel()[p.state("v")] for p in (plant, dragged)]
        assert rates[1] - rates[0] == pytest.approx(-200.0 * v * abs(v) / rig["M"])


def test_states_and_further_slots_and_own_formulas_of_known_names(written, rig):
    path = str(written(STATEFUL))
    soft, mine = load_effects(path)
    plant = build(rig, also=(soft, mine))
    assert plant.states[0].name == "my.rod.y"
    t = np.arange(51) * 1e-3
    u = np.full((51, len(plant.inputs)), 0.0)
    u[:, 0] = 0.1
    assert Engine(plant, back_end="interpreted").run(equilibrium(plant).x, t, u).ok
    assert find("jack.friction", "mine", [path]).source == "our own"
    assert find("jack.friction", "", [path]).formula == "coulomb"
    assert len(known_effects([path])) == len(known_effects()) + 2


def test_paths_are_beside_the_rig_and_stay(written, with_files, tmp_path, monkeypatch):
    written(DRAG)
    own = with_files('effect_files = ["mine.py"]')
    assert own.effect_files == (str((tmp_path / "mine.py").resolve()),)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    save_rig(own, Path("again.toml"))
    assert load_rig("again.toml").effect_files == own.effect_files
    assert build(load_rig("again.toml"))


def test_a_rig_without_files_says_nothing_of_them(rig, tmp_path):
    save_rig(rig, tmp_path / "plain.toml")
    assert "effect_files" not in (tmp_path / "plain.toml").read_text(encoding="utf-8")
    assert rig.effect_files == ()


@pytest.mark.parametrize("entry", ['"mine.py"', "[1]"])
def test_files_are_a_list(with_files, entry):
    with pytest.raises(InputError, match=r"effect_files = .*must be a list"):
        with_files(f"effect_files = {entry}")


BAD = (
    ("", "no effect in it"),
    ("x = = 1", "line 1: invalid syntax"),
    ("\nimport nowhere_at_all", "line 2: ModuleNotFoundError: No module named 'nowhere_at_all'"),
    (DRAG.replace('"force",', '"forces",'), 'line 5: my.drag quadratic: no equation "forces"; did you mean "force"?'),
    (DRAG.replace("my.drag", "drag"), 'effect name "drag": write it like "my.drag"'),
    (DRAG.replace("body_force", "body_farce"), 'no slot "body_farce"; did you mean "body_force"?'),
    (DRAG.replace("off=0.0", "off=-1.0"), "my.drag quadratic: c: typical and off must lie between low and high"),
    (DRAG.replace("400.0", "float('nan')"), "c: typical and off must lie"),
    (DRAG.replace('"N s^2/m^2"', '"furlongs^"'), 'my.drag quadratic: c: unknown unit "furlongs^"'),
    (DRAG.replace(' "N s^2/m^2",', ""), "line 12: TypeError: number() missing 1 required positional argument: 'si'"),
    (DRAG.replace("my.drag", "jack.friction").replace("quadratic", "lugre"), "jack.friction lugre is there already"),
    (f"{DRAG}\ndrag2 = drag", "my.drag quadratic is there already"),
)


def test_an_effect_of_some_kinds_of_valve_alone_need_not_say_why(rig, written):
    (drag,) = load_effects(written(DRAG.replace("    slot=", "    kinds=('pump',),\n    slot=")))
    assert missing(drag, rig.valve) == "no formula of it"


@pytest.mark.parametrize(("text", "message"), BAD, ids=[message[:30] for _, message in BAD])
def test_a_bad_file_is_told_in_a_line_with_its_name(written, text, message):
    path = written(text)
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        known_effects([path])
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_told(with_files, tmp_path):
    own = with_files('effect_files = ["absent.py"]')
    with pytest.raises(InputError, match=r"absent\.py: no such file"):
        build(own)
    (tmp_path / "absent.py").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"absent\.py: not text in UTF-8"):
        build(own)


LAWS = (
    ('s["velocty"]', 'no quantity in this slot "velocty"; did you mean "velocity"?'),
    ('s.p("d")', 'no number "d"; known: c'),
    ('s.x("z")', 'no state "z"; it has none'),
    ("None", "must return what it is given: force [N]"),
    ("(force, force)", "must return what it is given"),
    ("unknown", "fails: NameError: name 'unknown' is not defined"),
    ('s.p("c") if s.p("c") > 1 else force', "fails: "),
)


@pytest.mark.parametrize(("returned", "message"), LAWS, ids=[law for law, _ in LAWS])
def test_a_law_that_goes_wrong_is_told_with_its_name(written, rig, returned, message):
    path = written(DRAG.replace('force + s.p("c") * v * abs(v)', returned))
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        build(rig, also=load_effects(path))
    assert "my.drag quadratic" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_state_without_a_rate_is_told(written, rig):
    path = written(STATEFUL.replace('s.rate("y", ', "print("))
    with pytest.raises(InputError, match=re.escape("no rate for state my.rod.y")):
        build(rig, also=load_effects(path)[:1])


def test_an_unknown_name_is_sought_in_the_files_too(written, rig, with_effect):
    own = replace(with_effect("my.drg"), effect_files=(str(written(DRAG)),))
    with pytest.raises(InputError, match=re.escape('no effect "my.drg"; did you mean "my.drag"?')):
        build(own)
    ((effect, values),) = resolve(replace(with_effect("my.drag"), effect_files=own.effect_files))
    assert (effect.name, values) == ("my.drag", {"c": 400.0})
