"""What everything else stands on: nothing here knows a rig.

errors          the one exception for bad input
files           reading of files that others made, and places and names of files to come
units, signals  units at the borders; the signals of a jack rig by name
toml, table, key_lines    TOML files read strictly: a table that is asked by key; the line of each key
toml_text       TOML files as people write them: a number with its unit on one line
asked           functions that say what they want
checkpoint      stages of a long computation, and progress
trust, private_cache    code that comes with data, and whether it may run; where a user keeps things, and
                what a later start need not compute again
contained       readers of foreign files in a process with limits
recent          what was asked for last, as far as it finds room
cores, process_pool    processors, and worker processes that share them
cluster         worker processes of other machines, and what has to be the same there
desktop         a page in the browser of this machine
gain_phase      gain in decibels and phase in degrees of a complex response
rational_function    a rational function fitted to a complex response
columns, kept_columns    named columns, and as a pandas table; columns of many plants, on disk
numbers         numbers for metrics.json
words           counts, lists and ranges as a sentence has them
"""
