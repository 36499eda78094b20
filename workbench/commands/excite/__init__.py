"""`jackbench excite RIG KIND`: designs an excitation and writes the file that a drive plays.

valve_test    the excitations of a valve's sheet
"""
