"""How many cores the numbers of a process take, said to NumPy before it is imported."""

ALONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process that is one of as many as there are cores: the threads of all would wait
for each other."""
