"""Constraints: the smallest correction of a predicted motion that meets its targets."""
