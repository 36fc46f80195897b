"""Contacts of joints: labels of the captured clips, their reduction and their prediction."""
