"""Contacts of joints in motions."""
