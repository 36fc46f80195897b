"""Rigs: skeletons of characters in USD and glTF files, with the roles of their joints."""
