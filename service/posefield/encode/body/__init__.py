"""Body that a skeleton without a mesh wears: one skinned mesh, fitted to its bones."""
