"""`jackbench retune EXPERIMENT --found RIG`: what a fitted or traced rig buys a controller.

config        the experiment on the declared rig and on the found one
searchable    a run or bench experiment as the search of one of its controllers
study         old and retuned on both rigs
page          the report
platform      modal laws that follow the modes of a found platform
"""
