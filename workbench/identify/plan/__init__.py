"""Records that do not exist yet, as a plan compares them.

family             the records that are compared, each as large as the rig takes it
played             one of them played in simulation, also with one effect of a pair on
differences        how far effects differ in one of them, in each channel
advice             the record and the channel that show an effect, or tell it from others
questions          what a finished trace leaves to be recorded
motions            the motions that are compared on a platform
platform_played    one of them played in simulation, its legs cut out

What each adds to a campaign, pair by pair and number by number, is in identify/trace/record_gain.py.
"""
