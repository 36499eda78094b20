"""`jackbench excite RIG KIND`: designs an excitation and writes the file that a drive plays."""
