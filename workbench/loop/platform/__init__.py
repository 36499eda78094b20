"""Closed loops of a platform on six jacks, and every number that is measured on one.

setup           a platform as built: plant, engine, operating point, what decouples it
loop, compiled  a loop, run in Python or compiled; the sensors of its legs, and what comes in at each instant
transfer        poles, sensitivity, and the linear transfer of the pose, 6 x 6
steps           steps along one axis, by name; how far platforms are drawn
rows            what is measured in steps and in sines, with what the other axes do; a controller judged by both
robustness      platforms drawn over payload, pose and legs; loops and steps on them
excitation      motions that tell the axes apart, as large as the legs take them
measured        the 6 x 6 transfer as it is measured, with its uncertainty
learning        a drive file of six axes, learned
poses, record   roads, recorded courses and accelerations as poses at the control period; checked, played and learned
reached         sines inside and outside an axis's envelope; what a loop follows of it is in sines
reach           where it can go: stroke, joint angles, forces, flow, singular poses
"""

import lazy_loader

# An experiment is read without the plant.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
