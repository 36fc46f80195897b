"""Body that a skeleton without a mesh wears: one skinned mesh, made from its own proportions."""
