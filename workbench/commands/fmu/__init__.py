"""`jackbench fmu RIG`: a rig or platform as a functional mock-up unit (FMI 2.0), for model exchange and co-simulation.

model          the plant's graphs, variables and start values; its controller, where one is inside
platform       the same of a platform on six jacks
archive        modelDescription.xml and the graphs as C, compiled with fmu.c and fmi2.h, in one file
compiler       of this machine
"""
