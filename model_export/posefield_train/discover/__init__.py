"""Clips found in long recordings: strides, and motions like an example."""
