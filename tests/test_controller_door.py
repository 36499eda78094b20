"""Controllers as a person calls them: the folder's door, numbers with units and bounds, a file of one's own."""

import importlib
import inspect
import pickle
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest

import controllers
from controllers import Mpc, P, PressureFeedback, Switched
from controllers.p import P as Law
from workbench.base.errors import InputError
from workbench.base.table import ConfigTable
from workbench.control.controller_spec import controller_spec
from workbench.control.controller_type import controller

PERIOD = 1e-3
OWN = """
from controllers.p import P


class Law(P):
    '''A law of one's own.'''
"""


def sent_to_a_worker(spec):
    """The same after the way to a worker process of `tune` or `bench`, which pickles it."""
    return pickle.loads(pickle.dumps(spec))


def test_every_law_of_the_folder_is_at_its_door():
    """No file is forgotten, and every name at the door is the class in its file."""
    laws = {
        law.__name__: f"{module.__name__}:{law.__name__}"
        for entry in pkgutil.iter_modules(controllers.__path__, "controllers.")
        for module in [importlib.import_module(entry.name)]
        for law in vars(module).values()
        if inspect.isclass(law) and law.__module__ == module.__name__ and hasattr(law, "Design")
    }
    assert sorted({*laws, "Switched"}) == sorted(controllers.__all__)
    for name, use in laws.items():
        assert getattr(controllers, name)._use == use
    assert set(controllers.__all__) <= set(dir(controllers))
    assert inspect.isclass(Switched)


def test_a_controller_with_units_is_the_one_of_a_config():
    ours = P(gain="3.7 1/m") + PressureFeedback(gain="2.15e-4 1/bar", corner="0.25 Hz")
    table = {
        "use": "controllers.p:P",
        "gain": {"value": 3.7, "unit": "1/m"},
        "compensators": [
            {
                "use": "controllers.pressure:PressureFeedback",
                "gain": {"value": 2.15e-4, "unit": "1/bar"},
                "corner": {"value": 0.25, "unit": "Hz"},
            }
        ],
    }
    read = controller_spec("p", ConfigTable(table, "here"))
    assert (ours.design, ours.compensators[0].design) == (read.design, read.compensators[0].design)
    assert ours.name == "p+pressure-feedback"
    assert repr(ours) == "P(gain=3.7 1/m) + PressureFeedback(gain=2.15e-09 1/Pa, corner=0.25 Hz)"
    assert ours.named("mine").name == "mine"
    assert ours.on_load_cell("10 kN/mm").build(PERIOD).measures == ("force", "pa", "pb")
    assert sent_to_a_worker(ours) == ours


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"gain": -5}, "gain: -5 1/m is outside 0.001 to 1000 1/m"),
        ({"gain": "5e3 1/mm"}, "gain: 5e+06 1/m is outside 0.001 to 1000 1/m"),
        ({"gain": "5"}, 'gain: "5": write a number and its unit, such as "1 1/m"'),
        ({"gain": "five 1/m"}, 'gain: "five 1/m": write a number and its unit'),
        ({"gain": "3 mm"}, 'gain: unit "mm" cannot be converted to "1/m"'),
        ({"gain": float("nan")}, "gain: nan is no finite number"),
        ({"gain": float("inf")}, "gain: inf is no finite number"),
        ({"gain": True}, "gain: True is no finite number"),
        ({"gain": np.True_}, "gain: np.True_ is no finite number"),
        ({"gain": None}, "gain: None is no finite number"),
    ],
)
def test_a_design_refuses_what_is_out_of_bounds(numbers, message):
    for make, where in ((Law.Design, ""), (P, "P: ")):
        with pytest.raises(InputError, match="^" + re.escape(where + message)):
            make(**numbers)


def test_a_number_that_is_not_known_or_missing_is_named():
    with pytest.raises(InputError, match=re.escape('P: no number "gian"; did you mean "gain"?')):
        P(gian=1.0)
    with pytest.raises(InputError, match=re.escape("P: gain is missing (command per position error, in 1/m)")):
        P()
    with pytest.raises(InputError, match="add a compensator to a controller"):
        PressureFeedback(gain=1e-9) + P(gain=1.0)


def test_a_law_lists_its_numbers():
    assert repr(P).endswith("  gain  0.001 to 1000 1/m: command per position error")
    assert "horizon          0.005 to 1 s, default 0.08 s: how far a plan looks ahead" in repr(Mpc)
    assert P.__doc__.startswith("u = K e")
    assert str(inspect.signature(P)).startswith("(*, gain)")
    assert P.Design is Law.Design


def test_a_law_in_a_file_of_ones_own(tmp_path: Path, monkeypatch):
    (tmp_path / "mine.py").write_text(OWN)
    table = {"use": "mine.py:Law", "gain": {"value": 2.0, "unit": "1/m"}}
    read = controller_spec("mine", ConfigTable(table, "here"), tmp_path)
    assert read.use == f"{tmp_path}/mine.py:Law"
    assert np.allclose(read.build(PERIOD).linear().D, [[2.0, -2.0]])
    monkeypatch.chdir(tmp_path)
    assert controller("mine.py:Law", gain=2.0) == sent_to_a_worker(read).named("law")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = 1\nb = (", "mine.py: line 2: SyntaxError"),
        ("a = 1\n\nb = 1 / 0", "mine.py: line 3: ZeroDivisionError: division by zero"),
        ("raise SystemExit(2)", "mine.py: line 1: SystemExit: 2"),
        ("import nothing_of_that_name", "mine.py: line 1: ModuleNotFoundError: No module named"),
        ("class Lwa: ...", "has no class Law; did you mean"),
        ("class Law: ...", "is no controller: it has no dataclass Design"),
        (None, "no such file"),
    ],
)
def test_a_file_that_does_not_run_is_refused_in_one_line(tmp_path, text, message):
    if text is not None:
        (tmp_path / "mine.py").write_text(text)
    with pytest.raises(InputError, match=r'^here: use = "/.*/mine\.py:Law"') as caught:
        controller_spec("mine", ConfigTable({"use": "mine.py:Law"}, "here"), tmp_path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_has_changed_is_run_again(tmp_path):
    import os

    file = tmp_path / "mine.py"
    file.write_text(OWN)
    first = controller(f"{file}:Law", gain=2.0)
    file.write_text(OWN + "    measures = ('force',)\n")
    os.utime(file, ns=(1, 1))
    assert first.build(PERIOD).measures == ("force",)
