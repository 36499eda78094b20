"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records.

study, page, shares    one jack; what of a closed loop is the loop, its load, noise
platform       payload and legs of a platform
"""
