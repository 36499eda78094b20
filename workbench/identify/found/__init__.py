"""What a fit or a trace has found, said in numbers: nothing here is fitted to records again but what it shows.

fitted              numbers with intervals in the units that people read, and the rig with them
untold              numbers that the records of a closed loop do not tell stay as they were
session_fit         the numbers that sessions have to themselves
shifted             what a second logger recorded late or early, put back: sensor.shift
channels            how much longer intervals would be without a recorded signal
wrong_numbers       described numbers that records contradict
errors              held-out errors before and after, beside the noise
effect_by_effect    held-out free runs, with one more of what was added each time
alike               what explains as much as another value of a described number
law_curves          laws of effects over what they depend on, with their band
missing_shape       what an unknown disturbance looks like
detectability       from which strength on an effect would have shown
legs                the answers of six legs as one
wrench              what joints and payload of a platform lack
"""
