"""A robot in closed loop: coupled links, drives, friction and controllers of its joints, as injection simulates it.

The links come from [machine] (a planar arm, or a URDF), everything else per joint from [model] of the machine file. All
quantities are on the load side, in the order of the machine's joints.
"""
