"""`jackbench excite RIG KIND`: designs an excitation and writes the file that a drive plays.

sets    the excitations of a valve's sheet, and of a load cell's
"""
