"""`jackbench force-test CAMPAIGN|RIG`: the sheet of a load cell, in the manner of ISO 7500-1, ASTM E467, ISO 4965-1.

bench    a rig with its specimen, played: levels and sines of force beside a reference cell
"""
