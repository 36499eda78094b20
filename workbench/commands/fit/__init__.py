"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records.

study, page    one jack
remains         what is left in one run: drift, frequency, load
shares, ladder    what of a closed loop is the loop, its load, noise; how much structure its records bear
tells           what each signal tells of the numbers
platform       payload and legs of a platform
"""
