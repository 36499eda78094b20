"""`jackbench drive EXPERIMENT --at udp://HOST:PORT`: controllers of the workbench at a live rig.

options     what it is asked
study       what is played, and the rows of it
page        the report
"""
