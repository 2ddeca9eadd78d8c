"""Generated inputs: odd values in files, command lines and public functions.

A trial passes where the input is refused by one clean InputError (or exit code 2), or accepted with finite numbers of
physical signs. Nothing is solved: commands are let up to their solver. `python -m tests.fuzz --count 10000` for the
long run; test_fuzz.py is the short one.
"""
