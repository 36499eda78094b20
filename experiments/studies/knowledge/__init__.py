"""`python -m experiments.studies.knowledge EXPERIMENT`:
what knowing a rig's numbers is worth to its controllers, in seconds.

options, config    what it is asked; the experiment file
study              every structure tuned anew for every state of knowledge, and played on plants drawn within it
page               the table, and the picture with the limit
"""
