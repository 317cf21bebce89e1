"""How a machine moves: the class of a motion, its speed along the stroke, and which class a log runs so far."""

from cdtool.recordings.motion.motion_class import MotionClass, leading_joint, measured_class, motion_class

__all__ = ["MotionClass", "leading_joint", "measured_class", "motion_class"]
