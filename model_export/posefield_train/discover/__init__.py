"""Clips found in long takes: strides, and motions like an example."""
