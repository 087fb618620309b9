"""The one error that a user is meant to read: bad input, said in one line."""


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do, in one line."""
