"""Numeric arguments: accepted, or refused with the given value."""

import math
import operator

LARGEST = 3.4028234663852886e38
"""The largest float32."""


def number(value: object, name: str, *, infinite: bool = False) -> float:
    """A number that fits a float32; strings are refused."""
    wanted = f"a number from {-LARGEST:.2g} to {LARGEST:.2g}" + (", or infinite" if infinite else "")
    text = f"{name}: found {value!r:.60}, wanted {wanted}"
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(text)
    try:
        x = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise TypeError(text) from None
    except OverflowError:
        raise ValueError(text) from None
    if math.isnan(x) or (abs(x) > LARGEST and not (infinite and math.isinf(x))):
        raise ValueError(text)
    return x


def whole(value: object, name: str) -> int:
    """An integer from 0 to 2**32 - 1."""
    text = f"{name}: found {value!r:.60}, wanted an integer from 0 to {2**32 - 1}"
    try:
        x = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(text) from None
    if not 0 <= x < 2**32:
        raise ValueError(text)
    return x


def numbers(
    value: object, name: str, counts: tuple[int, ...], *, infinite: bool = False
) -> list[float]:
    """A sequence of numbers, as many as one of `counts`."""
    wanted = " or ".join(str(count) for count in counts)
    text = f"{name}: found {value!r:.60}, wanted {wanted} numbers"
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(text)
    try:
        values = list(value)  # type: ignore[call-overload]
    except TypeError:
        raise TypeError(text) from None
    if len(values) not in counts:
        raise ValueError(text)
    return [number(x, f"{name}[{i}]", infinite=infinite) for i, x in enumerate(values)]
