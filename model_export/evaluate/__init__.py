"""How far a model's motions lie from captured ones it has not seen, beside what else one could do."""
