"""How far a model's motions lie from captured ones that it has not seen, beside its peers'."""
