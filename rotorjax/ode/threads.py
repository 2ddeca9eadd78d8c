"""Dense factorisations on one thread.

OpenBLAS's threads wait for each other by spinning: where anything else runs on the machine, eigenvalues and Schur forms
of some hundred states take five to forty times as long on two threads as on one.
"""

from threadpoolctl import threadpool_limits

one_thread = threadpool_limits.wrap(limits=1, user_api="blas")
"""Decorator: BLAS and LAPACK keep to one thread within the function."""
