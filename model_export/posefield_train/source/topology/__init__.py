"""One topology for clips of different skeletons: joints by role, chains and a common rest pose."""
