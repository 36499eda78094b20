"""`jackbench plan CAMPAIGN`: what to record next, to tell alike effects apart and to see numbers that are not told.

fitted           a campaign whose rig is fitted, what it tells now, and records played with an effect on
metrics          the keys of metrics.json, best record first
platform         the same of a platform's legs: what it should move next; platform_page its report
sheets           which records a sheet that is to be signed still misses

The records that are compared are in identify/plan; what each adds to the campaign, pair by pair and number by number,
is in identify/trace/record_gain.py.
"""
