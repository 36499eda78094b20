"""Recordings of a rig: frozen signal tables, their readers and writers, campaign folders."""

from .campaign import Campaign, load_campaign
from .columns import ColumnMap
from .read import read_record
from .record import Record, block_mean
from .write import write_csv, write_parquet

__all__ = [
    "Campaign",
    "ColumnMap",
    "Record",
    "block_mean",
    "load_campaign",
    "read_record",
    "write_csv",
    "write_parquet",
]
