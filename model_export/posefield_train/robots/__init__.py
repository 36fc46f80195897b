"""Robots of MJCF and URDF files, and the doctor of their reference motions."""
