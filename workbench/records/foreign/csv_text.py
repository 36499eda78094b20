"""Text files of numbers, read in chunks: memory stays bounded however long the file is."""

import codecs
import gzip
import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np

from ...base.errors import InputError, short_path
from ...base.files import open_file
from ...base.words import counted
from ..table import MISSING
from .csv_shape import BLANKS, CsvShape, csv_shape
from .source import UNREAD, Source

if TYPE_CHECKING:
    import pyarrow
    from pyarrow.csv import CSVStreamingReader

Opened = Callable[[], AbstractContextManager[BinaryIO]]
HEAD = 64 * 1024  # bytes that tell the layout
CHUNK = 2**20  # bytes that are parsed at once; the parser reads up to 32 of them ahead
_FAULT = re.compile(r"In CSV column #(?P<column>\d+): (?:Row #(?P<row>\d+): )?.*invalid value '(?P<cell>[^']*)'")
_WORDS = (*MISSING, "-", "--", "---", "NaN", "-NaN")
_NULLS = sorted({text for word in _WORDS for text in (word, word.upper(), word.capitalize())} | {"NaN", "-NaN"})
_BLANKS, _EDGES, _PLUS = re.compile(rb"[ \t]+"), re.compile(rb"(?m)^ | $| (?=\r)"), re.compile(rb"(?m)(^|[;,\t |])\+")


def read_csv(path: Path, chunk: int = CHUNK) -> Source:
    """A text file of numbers under a header; `chunk` bytes of it are in memory at once.

    Raises InputError for a file without a table; its blocks raise it for a cell that is no number.
    """

    @contextmanager
    def opened() -> Iterator[BinaryIO]:
        with open_file(path, kind="recording") as file:
            yield cast(BinaryIO, gzip.GzipFile(fileobj=file)) if path.name.lower().endswith(".gz") else file

    return read_text(path, opened, chunk)


def read_text(path: Path, opened: Opened, chunk: int = CHUNK, delimiter: str | None = None) -> Source:
    """The source of text that `opened` gives as bytes, as often as it is asked; `path` is what messages name.

    delimiter: what separates the cells, where that is known.
    """
    with opened() as file:
        head = _readable(path, lambda: file.read(HEAD + 1))
    if not head:
        raise InputError(f"{short_path(path)}: the file is empty; record or export it again")
    shape = csv_shape(path, head[:HEAD], len(head) <= HEAD, delimiter)
    places = [place for place, kind in enumerate(shape.kinds) if kind != "text"]
    notes = [*shape.notes, *([f"{UNREAD}: {', '.join(shape.left)}"] if shape.left else [])]
    headings = tuple(shape.headings[place] for place in places)
    return Source(headings, _blocks(path, opened, shape, places, chunk, notes), shape.period, notes)


def _readable(path: Path, read: Callable[[], bytes]) -> bytes:
    try:
        return read()
    except (EOFError, OSError, zlib.error) as error:
        raise InputError(f"{short_path(path)}: broken or truncated ({error}); copy or record it again") from None


def _blocks(
    path: Path, opened: Opened, shape: CsvShape, places: Sequence[int], chunk: int, notes: list[str]
) -> Iterator[list[np.ndarray]]:
    """Columns of numbers, and cells of stamps, chunk by chunk; a broken row is left out and counted."""
    import pyarrow as pa

    broken: list[int] = []
    with opened() as file:
        try:
            for batch in _reader(_stream(file, shape), shape, places, chunk, broken):
                yield [_numbers(batch.column(i)) for i in range(batch.num_columns)]
        except pa.ArrowInvalid as error:
            raise _fault(path, shape, str(error)) from None
        except (EOFError, OSError, zlib.error) as error:
            raise InputError(f"{short_path(path)}: broken or truncated ({error}); copy or record it again") from None
    if broken:
        notes.append(f"{counted(len(broken), 'row')} left out: not {len(shape.headings)} cells")


def _reader(
    stream: "pyarrow.NativeFile", shape: CsvShape, places: Sequence[int], chunk: int, broken: list[int]
) -> "CSVStreamingReader":
    import pyarrow as pa
    import pyarrow.csv as pacsv

    def skip(row: pacsv.InvalidRow) -> str:
        broken.append(row.actual_columns)
        return "skip"

    kinds = {str(place): pa.float64() if shape.kinds[place] == "number" else pa.string() for place in places}
    return pacsv.open_csv(
        stream,
        pacsv.ReadOptions(
            use_threads=False,
            block_size=chunk,
            skip_rows=shape.skipped,
            column_names=[str(place) for place in range(len(shape.headings))],
        ),
        pacsv.ParseOptions(delimiter=shape.delimiter, invalid_row_handler=skip, newlines_in_values=shape.broken_cells),
        pacsv.ConvertOptions(
            column_types=kinds, include_columns=list(kinds), null_values=_NULLS, decimal_point=shape.decimal
        ),
    )


def _stream(file: BinaryIO, shape: CsvShape) -> "pyarrow.NativeFile":
    """The file as UTF-8 that the parser takes: another encoding, runs of blanks and plus signs are rewritten."""
    import pyarrow as pa

    steps: list[Callable[[bytes], bytes]] = []
    if shape.delimiter == BLANKS:
        steps.append(lambda lines: _EDGES.sub(b"", _BLANKS.sub(b" ", lines)))
    if shape.feeds:
        steps.append(lambda lines: lines.replace(b"\f", b""))
    if shape.plus:
        steps.append(lambda lines: _PLUS.sub(rb"\1", lines))
    if shape.remarked:
        steps.append(lambda lines: b"\n".join(_without_remark(line, shape) for line in lines.split(b"\n")))
    plain = pa.PythonFile(file, mode="r")
    if shape.encoding == "utf-8" and not steps:
        return plain
    return pa.TransformInputStream(plain, _rewriter(shape.encoding, steps))


def _without_remark(line: bytes, shape: CsvShape) -> bytes:
    width, mark = len(shape.headings), shape.delimiter.encode()
    return mark.join(line.split(mark)[:width]) if line.count(mark) == width and b'"' not in line else line


def _rewriter(encoding: str, steps: Sequence[Callable[[bytes], bytes]]) -> Callable[["pyarrow.Buffer"], bytes]:
    """Rewrites whole lines: what comes behind the last end of a line waits for the next chunk."""
    decoder, waiting = codecs.getincrementaldecoder(encoding)(), b""

    def rewrite(buffer: "pyarrow.Buffer") -> bytes:
        nonlocal waiting
        raw = bytes(buffer)
        text = waiting + decoder.decode(raw, final=not raw).encode()
        end = text.rfind(b"\n") + 1 if raw else len(text)
        lines, waiting = text[:end], text[end:]
        for step in steps:
            lines = step(lines)
        return lines

    return rewrite


def _numbers(column: "pyarrow.Array") -> np.ndarray:
    import pyarrow as pa

    if pa.types.is_string(column.type):
        return np.array(column.to_pylist(), dtype=object)
    return np.array(column.to_numpy(zero_copy_only=False), dtype=float)


def _fault(path: Path, shape: CsvShape, message: str) -> InputError:
    shown = short_path(path)
    if not (match := _FAULT.search(message)):
        return InputError(f"{shown}: cannot be read as a table of numbers ({message[:200]}); export it again")
    column = shape.headings[int(match["column"])].cell
    row = f"row {int(match['row'])}, " if match["row"] else ""
    return InputError(f'{shown}: {row}column "{column}": "{match["cell"]}" is not a number; mend it or leave it empty')
