"""Seeded mutations of what people write: TOML documents as trees, tables as cells, and any file as bytes."""

import string
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from random import Random
from typing import Any

import tomli_w

LONG = "q" * 150
"""A text of which no message may repeat more than 80 characters."""

NUMBERS = (0, 1, -1, 2, 7, 1e-300, -1e-9, 1e300, 1e9, 10**17, 10**30, 0.5, -0.0, float("nan"), float("inf"))
TEXTS = (
    "",
    " ",
    "nan",
    "10 mm",
    "1e9 bar",
    "-3 1/bar",
    "mm",
    "jack-10t",
    "p",
    "µm",
    "é\n\t",
    "a/b",
    "../x",
    "[0]",
    LONG,
)
UNITS = (
    "m",
    "mm",
    "1",
    "",
    "bar",
    "Pa",
    "degC",
    "Hz",
    "rad/s",
    "kN",
    "dB",
    "%",
    "1/bar",
    "m/s2",
    "furlong",
    "mm mm",
    "?",
)
ODD: tuple[Any, ...] = (*NUMBERS, *TEXTS, True, False, [], {}, [[]], [1, "a"], {"value": 1}, {"value": 1, "unit": "mm"})

Path = tuple[str | int, ...]
Tree = dict[str, Any]


def mutated_tree(tree: Tree, random: Random) -> Tree:
    """The document with one to three of its entries changed."""
    tree = deepcopy(tree)
    for _ in range(random.choice((1, 1, 2, 3))):
        places = [path for path in _paths(tree) if path]
        if places:
            place = random.choice(places)
            parent = _at(tree, place[:-1])
            random.choice(_CHANGES)(parent, place[-1], random, tree)
    return tree


def document(tree: Tree, random: Random) -> bytes:
    """The text of a mutated document, now and then with bytes that no TOML writer leaves."""
    raw = tomli_w.dumps(mutated_tree(tree, random)).encode()
    return mutated_bytes(raw, random) if random.random() < 0.2 else raw


def mutated_bytes(raw: bytes, random: Random) -> bytes:
    """A file that was cut, patched, re-encoded or mixed up; without NUL where it had none."""
    changed = random.choice(_PATCHES)(raw, random)
    return changed if b"\0" in raw else changed.replace(b"\0", b"?")


def _paths(value: Any, path: Path = ()) -> Iterator[Path]:
    yield path
    if isinstance(value, dict):
        entries: Sequence[tuple[str | int, Any]] = list(value.items())
    else:
        entries = list(enumerate(value)) if isinstance(value, list) else []
    for key, entry in entries:
        yield from _paths(entry, (*path, key))


def _at(tree: Any, path: Path) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def _delete(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    del parent[key]


def _odd(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    parent[key] = deepcopy(random.choice(ODD))


def _scaled(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    """Another number of the same type, or another text of the same length or so."""
    value = parent[key]
    if isinstance(value, str):
        parent[key] = _misspelt(value, random)
    elif isinstance(value, int | float) and abs(value) < 1e20:
        parent[key] = random.choice(
            (value * 10.0 ** random.randint(-12, 12), -value, value + 1, int(value), str(value))
        )
    else:
        _odd(parent, key, random, tree)


def _renamed(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    if isinstance(parent, dict):
        parent[random.choice((_misspelt(key, random), *TEXTS, "value", "unit", "file"))] = parent.pop(key)


def _wrapped(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    value = parent[key]
    inner = next(iter(value.values()), 0) if isinstance(value, dict) else value[:1] if isinstance(value, list) else "x"
    parent[key] = random.choice(([value], {"value": value}, [value, value], {"a": {"b": value}}, inner))


def _copied(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    """A part of the document in the place of another, or beside it."""
    source = deepcopy(_at(tree, random.choice(list(_paths(tree)))))
    if isinstance(parent, list):
        parent.append(source)
    else:
        parent[random.choice((key, "copy", random.choice(list(parent))))] = source


def _unit(parent: Any, key: Any, random: Random, tree: Tree) -> None:
    if isinstance(parent, dict) and "unit" in parent:
        parent["unit"] = random.choice(UNITS)
    elif isinstance(parent[key], str):
        parent[key] = f"{parent[key].split(' ')[0]} {random.choice(UNITS)}"
    else:
        _odd(parent, key, random, tree)


def _misspelt(text: str, random: Random) -> str:
    place = random.randint(0, len(text))
    letter = random.choice(string.ascii_letters + string.digits + "-_ .\n\"'é%[]{}=,")
    return random.choice((text[:place] + letter + text[place:], text[: max(place - 1, 0)] + text[place:], text.upper()))


_CHANGES: tuple[Callable[[Any, Any, Random, Tree], None], ...] = (
    *(_delete, _odd, _odd, _scaled, _scaled, _renamed, _wrapped, _copied, _unit),
)


def _cut(raw: bytes, random: Random) -> bytes:
    return raw[: random.randint(0, len(raw))]


def _patched(raw: bytes, random: Random) -> bytes:
    """Some bytes overwritten by any others."""
    patched = bytearray(raw)
    for _ in range(random.choice((1, 3, 10)) if patched else 0):
        patched[random.randrange(len(patched))] = random.randrange(256)
    return bytes(patched)


def _inserted(raw: bytes, random: Random) -> bytes:
    place = random.randint(0, len(raw))
    pieces = (
        b"\n",
        b'"',
        b"[",
        b"[[",
        b"]",
        b"=",
        b",",
        b"\xff",
        b"\xef\xbb\xbf",
        b"'''",
        b"#",
        b"\r",
        b"1e999",
        b"q" * 150,
    )
    return raw[:place] + random.choice(pieces) + raw[place:]


def _repeated(raw: bytes, random: Random) -> bytes:
    """A line again somewhere, or lines in another order."""
    lines = raw.split(b"\n")
    if random.random() < 0.5:
        random.shuffle(lines)
    else:
        lines.insert(random.randrange(len(lines)), random.choice(lines))
    return b"\n".join(lines)


def _encoded(raw: bytes, random: Random) -> bytes:
    text = raw.decode("latin-1")
    encoding = random.choice(("utf-16", "utf-8-sig", "latin-1", "crlf", "cr"))
    if encoding in ("crlf", "cr"):
        return raw.replace(b"\n", b"\r\n" if encoding == "crlf" else b"\r")
    return (text + "é").encode(encoding)


_PATCHES: tuple[Callable[[bytes, Random], bytes], ...] = (_cut, _patched, _inserted, _repeated, _encoded)
