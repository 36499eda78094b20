"""`python -m experiments.studies.trace`: traces campaigns whose truth is known, and scores the answers.

given          campaigns with their truth beside them
plan           what is drawn
campaigns      campaigns that are drawn
platforms      platforms that are drawn, with effects in their legs
joints         and with those of joints and payload
off_library    physics that the library of effects lacks
score          rates with intervals
"""
