"""Motion in NumPy: rotations, skeletons, clips and BVH; shared by service and training."""
