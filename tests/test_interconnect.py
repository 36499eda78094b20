"""Series, parallel, feedback and select by signal names: against python-control's own interconnection."""

import subprocess
import sys

import control
import numpy as np
import pytest

from workbench.linear.interconnect import feedback, parallel, select, series
from workbench.linear.state_space import as_state_space, state_space

Z = np.exp(2j * np.pi * np.array([0.01, 0.1, 0.37]))


def system(seed, inputs, outputs, direct=True):
    random = np.random.default_rng(seed)
    n, m, k = 3, len(inputs), len(outputs)
    d = random.normal(size=(k, m)) * direct
    a, b, c = random.normal(size=(n, n)) / 4, random.normal(size=(n, m)), random.normal(size=(k, n))
    return state_space(a, b, c, d, 1.0, inputs, outputs)


def theirs(systems, inputs, outputs):
    """python-control connects what has one name."""
    named = [part.to_control(name=f"part{i}") for i, part in enumerate(systems)]
    whole = control.interconnect(
        named, inplist=inputs, outlist=outputs, inputs=inputs, outputs=outputs, check_unused=False
    )
    return whole(Z, squeeze=False)


def test_series_is_that_of_python_control():
    first, second = system(0, ["a", "b"], ["c", "d"]), system(1, ["d", "e"], ["f"])
    ours = series(first, second)
    assert (ours.input_labels, ours.output_labels) == (["a", "b", "e"], ["f"])
    assert ours(Z, squeeze=False) == pytest.approx(theirs([first, second], ["a", "b", "e"], ["f"]))


def test_a_loop_is_that_of_its_responses():
    plant = system(0, ["command", "push"], ["position", "pressure"], direct=False)
    law = system(1, ["reference", "position"], ["command"])
    whole = select(feedback(plant, law), ["reference", "push", "command"], ["pressure"])(Z, squeeze=False)[0]
    p, c = plant(Z), law(Z)
    loop = 1 - c[0, 1] * p[0, 0]
    assert whole[0] == pytest.approx(p[1, 0] * c[0, 0] / loop)
    assert whole[1] == pytest.approx(p[1, 1] + p[1, 0] * c[0, 1] * p[0, 1] / loop)
    assert whole[2] == pytest.approx(p[1, 0] / loop)
    with pytest.raises(ValueError, match="algebraic loop"):
        feedback(system(0, ["command"], ["position"]), law)


def test_outputs_of_one_name_add_up():
    one, other = system(0, ["a"], ["y"]), system(1, ["b", "a"], ["y"])
    whole = parallel(one, other)(Z, squeeze=False)[0]
    assert whole[0] == pytest.approx(one(Z) + other(Z)[0, 1])
    assert whole[1] == pytest.approx(other(Z)[0, 0])


def test_there_and_back():
    one = system(0, ["a", "b"], ["y"])
    again = as_state_space(one.to_control())
    assert (again.input_labels, again.output_labels, again.dt) == (["a", "b"], ["y"], 1.0)
    assert again(Z) == pytest.approx(one(Z))


def test_controllers_and_loops_wait_for_no_slow_import():
    code = (
        "import sys, workbench.loop.rows, workbench.control.export\n"
        "import controllers.mpc, controllers.crone3, controllers.tvc\n"
        "assert not {'control', 'scipy.signal', 'scipy.stats', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
