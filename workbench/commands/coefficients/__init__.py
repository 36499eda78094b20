"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period.

folder    the folder of laws that a rig's own controller, MATLAB and python-control take
"""
