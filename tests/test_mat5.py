"""MAT files of version 5, read as scipy reads them, and refused where a byte is damaged."""

import io
from random import Random

import numpy as np
import pytest
from mutants import mutated_bytes
from scipy.io import loadmat, savemat

from workbench.base.errors import InputError
from workbench.records.mat import vectors

VARIABLES = {
    "t": np.arange(20) * 1e-3,
    "column": np.arange(5.0)[:, None],
    "short": np.array([1, 2], np.int8),
    "single": np.arange(7, dtype=np.float32),
    "wide": np.array([2**60, -3]),
    "unsigned": np.array([1, 2, 3], np.uint16),
    "flags": np.array([True, False, True]),
    "matrix": np.ones((3, 4)),
    "scalar": 2.5,
    "complex": np.arange(3) * 1j,
    "text": "a text",
    "structure": {"a": np.arange(3.0)},
    "cells": np.array([1.0, "b"], dtype=object),
    "empty": np.zeros((0, 0)),
    "with_a_rather_long_name": np.arange(4.0),
}


def file_bytes(compressed):
    buffer = io.BytesIO()
    savemat(buffer, VARIABLES, do_compression=compressed)
    return buffer.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_vectors_are_those_that_scipy_reads(tmp_path, compressed):
    path = tmp_path / "a.mat"
    path.write_bytes(file_bytes(compressed))
    names = ("t", "column", "short", "single", "wide", "unsigned", "flags", "with_a_rather_long_name")
    read, expected = vectors(path), loadmat(path)
    assert tuple(read) == names
    for name in names:
        np.testing.assert_array_equal(read[name], expected[name].ravel())
        assert read[name].dtype == expected[name].dtype


@pytest.mark.parametrize("compressed", [False, True])
def test_a_damaged_file_is_read_or_refused(tmp_path, compressed):
    """Where a C reader would end the process."""
    raw, path = file_bytes(compressed), tmp_path / "a.mat"
    refused = 0
    for seed in range(500):
        path.write_bytes(mutated_bytes(raw, Random(seed)))
        try:
            vectors(path)
        except InputError:
            refused += 1
    assert 100 < refused < 500


def test_a_type_that_does_not_exist_is_refused(tmp_path):
    raw = bytearray(file_bytes(compressed=False))
    tag = raw.index(b"\x01\x00\x01\x00t") + 8
    raw[tag] = 110
    (tmp_path / "a.mat").write_bytes(raw)
    with pytest.raises(InputError, match="numbers of an unknown type, 110"):
        vectors(tmp_path / "a.mat")
