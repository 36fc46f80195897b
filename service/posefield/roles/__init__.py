"""Roles of joints, such as left upper arm, by names, structure and shape, with a confidence."""
