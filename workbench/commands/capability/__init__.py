"""`jackbench capability RIG|PLATFORM`: what a rig can do: its envelope, what a loop follows, what a drive file takes.

config       what is asked, with the files read
catalogue    valves and pumps of a catalogue
figures      the figures of a rig, and how far its bounds move them
found        what its page shows besides lines
tuned        the loop that is played: of an experiment, or one that tunes itself
platform     the envelopes of a platform's axes; sines and a loop that are played along them
pictures     envelopes as people hang them on the wall
"""
