"""A bar for loops that last."""

from collections.abc import Iterable, Iterator
from typing import TypeVar

from tqdm import tqdm

T = TypeVar("T")
_SECONDS = 2.0


def with_bar(items: Iterable[T], what: str, wanted: bool | None = None) -> Iterator[T]:
    """The items one by one. `wanted`: whether a bar is shown; `None` shows one on a terminal, where the loop
    lasts for more than two seconds."""
    hidden = None if wanted is None else not wanted
    yield from tqdm(items, what, disable=hidden, delay=0 if wanted else _SECONDS, leave=False)
