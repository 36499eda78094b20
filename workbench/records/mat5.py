"""MATLAB files of version 5: their numeric arrays, read with every length and type checked.

MAT-File Format, The MathWorks, 2023. scipy's reader, written in C, ends the whole process at a type that does not
exist, as one damaged byte can make it.
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..base.files import MOST_BYTES, read_bytes

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # data types
_NUMERIC_CLASSES = range(6, 16)  # double, single, and whole numbers of 8 to 64 bits
_COMPLEX = 0x0800


def is_version5(path: Path) -> bool:
    """Whether the file's header says so."""
    with path.open("rb") as file:
        header = file.read(_HEADER)
    return len(header) == _HEADER and 0 not in header[:4] and header[126:] in (b"IM", b"MI")


def numeric_arrays(path: Path) -> dict[str, np.ndarray]:
    """Every real numeric array by name, in the type in which it is stored, as scipy.io.loadmat gives it.

    Raises ValueError for a damaged file.
    """
    raw = read_bytes(path, kind="record")
    order = "<" if raw[126:128] == b"IM" else ">"
    arrays = {}
    for kind, element in _elements(raw[_HEADER:], order, align=1):
        matrices = _elements(_unpacked(element), order) if kind == _COMPRESSED else [(kind, element)]
        for inner, matrix in matrices:
            if inner != _MATRIX:
                raise ValueError(f"an element of type {inner} where an array should be")
            arrays |= _array(matrix, order)
    return arrays


def _elements(raw: bytes, order: str, align: int = 8) -> Iterator[tuple[int, bytes]]:
    """Type and content of the elements one after the other, each of which begins at a multiple of `align` bytes."""
    place = 0
    while place < len(raw):
        if len(raw) - place < 8:
            raise ValueError("cut off inside a tag")
        kind, size = struct.unpack_from(f"{order}II", raw, place)
        start, room = place + 8, len(raw) - place - 8
        if kind > 0xFFFF:  # a small element: its size and up to four bytes of content are in the tag
            kind, size, start, room = kind & 0xFFFF, kind >> 16, place + 4, 4
        if size > room:
            raise ValueError("cut off inside an element")
        yield kind, raw[start : start + size]
        place = max(place + 8, -(-(start + size) // align) * align)


def _unpacked(element: bytes) -> bytes:
    unpacking = zlib.decompressobj()
    try:
        content = unpacking.decompress(element, MOST_BYTES)
    except zlib.error as error:
        raise ValueError(str(error)) from None
    if not unpacking.eof:
        raise ValueError("a compressed array that is cut off, or too large")
    return content


def _array(matrix: bytes, order: str) -> dict[str, np.ndarray]:
    """The array by its name; nothing where it is not of real numbers."""
    parts = _elements(matrix, order)
    try:
        flags, dimensions, name = (content for _, content in (next(parts), next(parts), next(parts)))
        flag = struct.unpack_from(f"{order}I", flags)[0]
        if flag & 0xFF not in _NUMERIC_CLASSES or flag & _COMPLEX:
            return {}
        kind, content = next(parts)
    except (StopIteration, struct.error):
        raise ValueError("an array without all its parts") from None
    if kind not in _STORED:
        raise ValueError(f"numbers of an unknown type, {kind}")
    shape = np.frombuffer(dimensions, f"{order}i4")
    values = np.frombuffer(content, f"{order}{_STORED[kind]}")
    return {name.decode("latin-1"): values.reshape(shape.tolist(), order="F")}
