"""Number of BLAS threads of a server process."""

import os

from threadpoolctl import threadpool_limits

from service.motion.cores import ALONE


def limit_threads() -> None:
    """Limit BLAS to one thread, unless the environment sets its number of threads.

    Idle BLAS threads spin: with two threads a grid of sigma takes 1.5 to 8 times the CPU time
    (decision 0027). The last bits of results depend on the number of threads, and worker processes
    and exports have one.
    """
    if not ALONE.keys() & os.environ.keys():
        threadpool_limits(1, user_api="blas")
