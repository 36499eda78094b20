"""On which line of a TOML document each key stands: what a complaint names, and tomllib does not tell.

One pass over a text that tomllib has already accepted, so that only the extent of keys and values matters.
"""

import re
import tomllib
from contextlib import suppress

KeyPath = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_STRING = re.compile(r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'', re.DOTALL)
_KEY_PART = re.compile(r'[ \t]*("(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|[A-Za-z0-9_-]+)[ \t]*')
_SCALAR = re.compile(r"[^,\]}#\n]*")


def key_lines(text: str) -> dict[KeyPath, int]:
    """The line, from 1, of every key, header and list entry of a valid TOML text, by its path; list entries count
    from 0.

    A text that cannot be followed gives what was found up to there.
    """
    scanner = _Scanner(text)
    with suppress(IndexError, RecursionError):  # not TOML after all, or nested without end
        scanner.document()
    return scanner.lines


class _Scanner:
    """Reads statement by statement; `lines` fills as it goes."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.lines: dict[KeyPath, int] = {}
        self._entries: dict[KeyPath, int] = {}  # tables so far of each [[list]]
        self._line, self._counted = 1, 0

    def document(self) -> None:
        header: KeyPath = ()
        while self._blank():
            if self._skip("[["):
                header = self._list_entry(self._key())
                self.at += 2
            elif self._skip("["):
                header = self._placed(self._key())
                self.at += 1
            else:
                self._assignment(header)

    def _assignment(self, table: KeyPath) -> None:
        line, key = self._here(), self._key()
        for end in range(1, len(key) + 1):
            self.lines.setdefault(table + key[:end], line)
        self.at += 1  # the equals sign
        self._value(table + key)

    def _value(self, path: KeyPath) -> None:
        self._blank()
        if self._skip("["):
            self._list(path)
        elif self._skip("{"):
            while self._blank() and not self._skip("}"):
                self._assignment(path)
                self._blank()
                self._skip(",")
        elif not self._past(_STRING):
            self._past(_SCALAR)

    def _list(self, path: KeyPath) -> None:
        index = 0
        while self._blank() and not self._skip("]"):
            self.lines[*path, index] = self._here()
            self._value((*path, index))
            self._blank()
            self._skip(",")
            index += 1

    def _key(self) -> KeyPath:
        parts = []
        while True:
            part = _match(_KEY_PART, self.text, self.at)
            self.at = part.end()
            parts.append(_plain(part[1]))
            if not self._skip("."):
                return tuple(parts)

    def _placed(self, header: KeyPath) -> KeyPath:
        """The path of a header's table, through the last entry of every list on the way."""
        path: KeyPath = ()
        for part in header:
            path = (*path, part)
            self.lines.setdefault(path, self._here())
            if path in self._entries:
                path = (*path, self._entries[path] - 1)
        return path

    def _list_entry(self, header: KeyPath) -> KeyPath:
        path = (*self._placed(header[:-1]), header[-1])
        self._entries[path] = self._entries.get(path, 0) + 1
        entry = (*path, self._entries[path] - 1)
        self.lines.setdefault(path, self._here())
        self.lines[entry] = self._here()
        return entry

    def _blank(self) -> bool:
        """Go past blanks and comments; whether anything follows."""
        self.at = _match(_BLANK, self.text, self.at).end()
        return self.at < len(self.text)

    def _skip(self, token: str) -> bool:
        met = self.text.startswith(token, self.at)
        self.at += len(token) if met else 0
        return met

    def _past(self, pattern: re.Pattern[str]) -> bool:
        match = pattern.match(self.text, self.at)
        self.at = match.end() if match else self.at
        return match is not None

    def _here(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line


def _match(pattern: re.Pattern[str], text: str, at: int) -> re.Match[str]:
    match = pattern.match(text, at)
    if match is None:
        raise IndexError(at)
    return match


def _plain(part: str) -> str:
    """A key without its quotes and escapes."""
    return tomllib.loads(f"key = {part}")["key"] if part[0] in "\"'" else part
