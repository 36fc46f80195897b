"""Conversion of motion files to BVH, of FBX files through an installed Blender."""
