"""Feet that stand: footsteps planned from contacts, and legs that follow them."""
