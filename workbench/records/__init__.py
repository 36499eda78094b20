"""Recordings of a rig: frozen signal tables, their readers and writers, campaign folders.

record                 a frozen table of what was logged, and its files
described              campaign files of public data sets that come without one
campaign, sessions     which records of a rig are fitted and which only judge; which are of another state of it
dated_sessions         a rig's recordings over months
fingerprint            what says that a campaign is the same one
read, repair           records from files; what is mended on the way
table, mat             files as tables of numbers
columns                which column is which signal
pair                   two columns of a recording, whatever they are called
frequency_sheet        a frequency response as a small table
sheet_points           a frequency response with gaps, as a record
rational_fit           a rational model with a delay, fitted to one
foreign                recordings as laboratories leave them, made strict tables
excitation, road       what a drive plays; random roads
"""

from .campaign import Campaign, InputNoise, load_campaign
from .columns import ColumnMap
from .read import read_record
from .record import Record, block_mean, centred_means, write_csv, write_parquet

__all__ = [
    "Campaign",
    "ColumnMap",
    "InputNoise",
    "Record",
    "block_mean",
    "centred_means",
    "load_campaign",
    "read_record",
    "write_csv",
    "write_parquet",
]
