"""Answers that meet what they are asked for: the reduced motion corrected until they do."""
