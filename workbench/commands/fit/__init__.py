"""`jackbench fit CAMPAIGN`: the numbers of a rig that have bounds, fitted to its records.

study, page    one jack
platform       payload and legs of a platform
"""
