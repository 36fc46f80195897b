"""Parts of the add-on without bpy: HTTP requests, decoding, and bones as arrays.

They are tested by an ordinary interpreter.
"""
