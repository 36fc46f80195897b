"""How far a model's motions lie from what it has not seen, and what the paper measured."""
