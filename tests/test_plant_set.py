"""The names of the set of rigs."""

import pytest

from workbench.base.errors import InputError
from workbench.loop.rig_variations import RIG_SET, variation
from workbench.rigs.rig_file import load_rig


def test_each_name_moves_one_number_and_is_the_name_of_the_rig():
    rig = load_rig("jack-10t")
    moved = {name: variation(rig, name) for name in RIG_SET}
    assert all(found.name == name for name, found in moved.items())
    assert (moved["mass-50"]["M"], moved["mass+50"]["M"]) == (0.5 * rig["M"], 1.5 * rig["M"])
    assert moved["beta-50"]["beta"] == 0.5 * rig["beta"]
    assert moved["supply-20"]["Ps"] == 0.8 * rig["Ps"]
    assert moved["stiffness-1e8"]["ks"] == 1e8
    assert moved["nominal"].numbers == rig.numbers


def test_an_unknown_name_is_told_its_neighbour():
    with pytest.raises(InputError, match=r'no rig "mass50" in the set; did you mean "mass.50"\?'):
        variation(load_rig("jack-10t"), "mass50")
