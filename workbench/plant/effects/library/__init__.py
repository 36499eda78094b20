"""The library of effects, a file each physical cause: a file that is put here is in it, after those that are.

drive, pilot                of the drive and the pilot stage
rate                        of the spool of a valve without a modelled pilot
lands, supply, leakage, air    of the flows
friction, load, compliance    of the forces
sensor                      of the pressure transducers
pump_drive, pump_load       of pump drives, of what they move and of what measures it
"""
