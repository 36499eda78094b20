"""`jackbench plan CAMPAIGN`: what to record next, to tell alike effects apart and to see numbers that are not told.

family      the records that are compared, each as large as the rig takes it
metrics     the keys of metrics.json, best record first
sheets      which records a sheet that is to be signed still misses
played      the best of them played in simulation with one effect of a pair on

What each adds to the campaign, pair by pair and number by number, is in identify/trace/record_gain.py.
"""
