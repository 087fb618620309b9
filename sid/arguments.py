"""What an argument may be, and how one that may not is refused: by name, in one line."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from numbers import Integral, Real
from typing import Any, NoReturn

from sid.errors import InputError


@dataclass(frozen=True)
class Bounds:
    """A type with its bounds, which the configuration, the command and Python have in common.

    Attributes
    ----------
    least, most : float
        Smallest and largest value. Infinity is no value.
    above : bool
        Whether the value must exceed ``least``.
    whole : bool
        Whether it must be a whole number.
    known : tuple of str
        Texts, one of which it must be, instead of a number.
    items : int
        0 for one number; else it must be a list of at most so many of them, at least one.
    optional : bool
        Whether it may be None.

    Examples
    --------
    >>> Bounds(1, 20, whole=True).check("rings", 2)
    >>> Bounds(0, 1).check("threshold_rel", float("nan"))
    Traceback (most recent call last):
        ...
    sid.errors.InputError: threshold_rel is nan; it must be a number from 0 to 1
    """

    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    whole: bool = False
    known: tuple[str, ...] = ()
    items: int = 0
    optional: bool = False

    def check(self, name: str, value: Any) -> None:
        """Refuse what is not within the bounds.

        Parameters
        ----------
        name : str
            What the message calls it.
        value
            Of any type.

        Raises
        ------
        InputError
            With the name, the value and what it must be.
        """
        if not self.allows(value):
            raise InputError(f"{name} is {show_value(value)}; {self.rule}")

    def allows(self, value: Any) -> bool:
        """Whether a value is within the bounds.

        Parameters
        ----------
        value
            Of any type.

        Returns
        -------
        bool
        """
        if value is None:
            return self.optional
        if self.known:
            return isinstance(value, str) and value in self.known
        if not self.items:
            return self._allows_number(value)
        if isinstance(value, str | bytes | dict) or not hasattr(value, "__len__"):
            return False
        return 1 <= len(value) <= self.items and all(map(self._allows_number, value))

    def _allows_number(self, value: Any) -> bool:
        if isinstance(value, bool) or not isinstance(value, Integral if self.whole else Real):
            return False
        try:
            finite = math.isfinite(value)
        except OverflowError:  # a whole number that no floating-point number holds
            return False
        number = float(value)
        return finite and self.least <= number <= self.most and not (self.above and number == self.least)

    @property
    def rule(self) -> str:
        """What it must be, as the end of a sentence."""
        if self.known:
            return f"known are {', '.join(self.known)}"
        kind = "a finite number" if math.isinf(self.most) else "a number"
        kind = "a whole number" if self.whole else kind
        if self.items:
            kind = f"a list of at most {self.items} {'whole numbers' if self.whole else 'numbers'}, each"
        if math.isinf(self.least):
            limits = ""
        elif self.above:
            limits = f" greater than {self.least:g}" + (
                "" if math.isinf(self.most) else f", at most {self.most:g}"
            )
        elif math.isinf(self.most):
            limits = f" from {self.least:g} on"
        else:
            limits = f" from {self.least:g} to {self.most:.15g}"
        return f"it must be {kind}{limits}{' or None' if self.optional else ''}"


def refuse_unknown(what: str, name: Any, known: Iterable[str]) -> NoReturn:
    """Refuse a name that is none of those that are known.

    Parameters
    ----------
    what : str
        The message without its end.
    name
        The name.
    known : iterable of str

    Raises
    ------
    InputError
        Always; with the name that was meant where one is like it, and those that are known.

    Examples
    --------
    >>> refuse_unknown("unknown detector 'hsk'", "hsk", ["hks", "sid"])
    Traceback (most recent call last):
        ...
    sid.errors.InputError: unknown detector 'hsk'; did you mean hks? Known are hks, sid
    """
    known = list(known)
    close = get_close_matches(name, known, 1) if isinstance(name, str) else []
    hint = f"did you mean {close[0]}? Known" if close else "known"
    raise InputError(f"{what}; {hint} are {', '.join(known)}")


def show_value(value: Any) -> str:
    """A value as a message shows it, in one line that is not long.

    Parameters
    ----------
    value
        Of any type.

    Returns
    -------
    str

    Examples
    --------
    >>> show_value(list(range(100)))
    '[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 1...'
    """
    if type(value) is int and value.bit_length() > 200:  # Python refuses to print very long ones
        return f"a whole number of about {int(value.bit_length() * math.log10(2)) + 1} digits"
    if type(value).__module__ == "numpy" and getattr(value, "ndim", 1) == 0:
        value = value.item()  # 2.5, not np.float64(2.5)
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else f"{text[:60]}..."
