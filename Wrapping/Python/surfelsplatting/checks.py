# SPDX-License-Identifier: BSD-3-Clause
"""Checks of what functions are given: the names of arguments, and their values."""

from difflib import get_close_matches
from functools import wraps
from inspect import signature
import math
from typing import Callable, TypeVar

F, C = TypeVar("F", bound=Callable), TypeVar("C", bound=type)


def check_names(names, known, call, otherwise, elsewhere=()):
    """Raises TypeError for an argument that a call does not have: the name that was meant, or else what
    to do.

    elsewhere: what to do by the names that other calls have, with {} for the name
    """
    for name in names:
        if name not in known:
            near = [] if name in elsewhere else get_close_matches(name, known, 1)
            if name in elsewhere:
                otherwise = elsewhere[name].format(name)
            raise TypeError(f"{call} has no argument {name!r}; "
                            + (f"did you mean {near[0]!r}?" if near else otherwise))


def with_checked_names(call, elsewhere=()):
    """Decorates a function: check_names of its arguments, and else it says which ones there are."""
    def decorate(function: F) -> F:
        known = [name for name in signature(function).parameters if name != "self"]

        @wraps(function)
        def checked(*args, **kwargs):
            check_names(kwargs, known, call, f"it has {', '.join(known)}", elsewhere)
            return function(*args, **kwargs)
        return checked
    return decorate


def with_checked_init(kind: C) -> C:
    """Decorates a class: the same for its arguments."""
    kind.__init__ = with_checked_names(kind.__name__)(kind.__init__)
    return kind


def finite_triple(values, what):
    """Three finite numbers as a tuple of floats, or ValueError."""
    try:
        triple = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        triple = ()
    if len(triple) != 3 or not all(map(math.isfinite, triple)):
        raise ValueError(f"{what} is {values!r}; it must be three finite numbers")
    return triple


def number_in(value, smallest, largest, what):
    """The number if it is between these, or ValueError."""
    try:
        if smallest <= value <= largest:
            return value
    except (TypeError, ValueError):  # no number, or several
        pass
    raise ValueError(f"{what} is {value!r}; it must be a number from {smallest:g} to {largest:g}")


def whole_number_in(value, smallest, largest, what):
    """The whole number if it is between these, or ValueError."""
    if number_in(value, smallest, largest, what) != int(value):
        raise ValueError(f"{what} is {value!r}; it must be a whole number")
    return int(value)


def one_of(value, choices, what):
    if value not in choices:
        raise ValueError(f"{what} is {value!r}; it must be one of {', '.join(map(repr, choices))}")
    return value
