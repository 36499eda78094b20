"""Recordings as labs leave them, read leniently once and written as the strict tables that `records` reads.

source        what every format is read into: headed columns of numbers, block by block
open          a file by its suffix
csv_shape, csv_text    text of numbers: its layout; its rows in chunks
parquet       tables of another maker
matlab, hdf5, nested, labels    structures: what lies beside a clock belongs to it; names and rates beside numbers
rpc           drive files and responses of test rigs
tdms, mdf, xlsx, uff, optional    formats whose libraries are optional
clocks        channels with clocks of their own on one clock
vocabulary    what a column's name says, in English, German and French
stamps, dated, origin    dates, times of day, counts since an epoch; a file's clock as seconds from its first row
unit_names    units as header cells have them
parts         strict .parquet tables of a foreign file
"""

from .open import open_foreign
from .parts import ConvertedTable, column, renamed, write_parts
from .source import UNREAD, Heading, Source

__all__ = ["UNREAD", "ConvertedTable", "Heading", "Source", "column", "open_foreign", "renamed", "write_parts"]
