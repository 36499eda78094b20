"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records.

study, page    one jack
shares, ladder    what of a closed loop is the loop, its load, noise; how much structure its records bear
tells           what each signal tells of the numbers
platform       payload and legs of a platform
"""
