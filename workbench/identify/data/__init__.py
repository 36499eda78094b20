"""What recordings say by themselves.

noise_floor         how far a perfect model would still be from each signal
whiteness           whether a residual is noise
frequency_response  gain, phase, coherence and a 95 % band of a pair of signals
"""
