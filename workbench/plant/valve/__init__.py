"""The valve's stages.

pilot        torque motor, nozzles and flapper, pilot spool
main_stage   the main spool with its position loop; the second-order spool of a valve known by its datasheet
supply       what the main lands draw
"""
