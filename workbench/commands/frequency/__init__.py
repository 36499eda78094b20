"""`jackbench frequency CAMPAIGN|RECORDING...|SHEET --output SIGNAL`: a measured response beside a model's.

two_columns    any two columns of recordings, with the transfer function that is fitted to them
"""
