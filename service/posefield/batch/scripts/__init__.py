"""Performances of many scripts: scripts in, files and their manifest out."""
