"""Answers that satisfy constraints: the smallest correction of the predicted reduced motion."""
