"""The one error that bad input raises, at the door."""


class InputError(ValueError):
    """A value that cannot be used: the message names it, the rule and the way out. The command line exits with 2."""
