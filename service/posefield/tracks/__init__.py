"""Trajectories of pedestrians: files of simulators and trackers, and people who walk along them."""
