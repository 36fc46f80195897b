"""The add-on's code that needs no Blender."""
