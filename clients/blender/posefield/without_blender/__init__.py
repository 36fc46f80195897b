"""What the add-on does without Blender: questions over HTTP, what comes back, and bones as numbers.

Nothing here imports bpy, so that it is tested by the ordinary interpreter.
"""
