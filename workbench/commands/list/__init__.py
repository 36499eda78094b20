"""`jackbench list rigs|controllers|effects|experiments`.

catalogue    what there is to choose from
"""
