"""Motion in NumPy: rotations, skeletons, clips and BVH, shared by the service and the training job."""
