"""Evaluation of the families of the results pages: peers, targets, feet, takes, performers."""
