"""The one error that bad input raises, at the door."""


class InputError(ValueError):
    """A value that cannot be used: the message names it, the rule and the way out. The command line exits with 2."""


class ArgumentError(InputError):
    """An argument that breaks its rule, in parts, so that a file's reader can put the file's own key in its place."""

    def __init__(self, name: str, rule: str, found: str):
        """``Argument `name` must rule, but is found``."""
        super().__init__(f"Argument `{name}` must {rule}, but is {found}")
        self.name, self.rule, self.found = name, rule, found

    def __reduce__(self) -> tuple:
        """How another process gets it: an exception is made anew from `args`, which here is the whole sentence."""
        return type(self), (self.name, self.rule, self.found)

    def under(self, where: str) -> InputError:
        """The same complaint about what the user wrote."""
        return InputError(f"{where} must {self.rule}, but is {self.found}")
