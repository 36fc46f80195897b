"""Limit of NumPy's threads per process, set in the environment before NumPy is imported."""

SINGLE_THREAD_ENV = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
"""Environment of a worker process where there is one worker per core.

With more than one BLAS thread each, the threads of all workers would wait for each other.
"""
