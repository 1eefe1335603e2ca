"""Collects what is wrong with a study, so that the user sees all of it at once."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, field


@dataclass
class Faults:
    """The sentences found so far."""

    sentences: list[str] = field(default_factory=list)

    def add(self, place: str, predicate: str) -> None:
        """`place` is where in the file, such as `line "shaft 2"`; `predicate` says the rest."""
        self.sentences.append(f"`{place}`: {predicate}")

    def unknown_keys(self, place: str, table: dict, known: Iterable[str], prefix: str = "") -> None:
        """Refuses every key of `table` that is not among the known."""
        known = list(known)
        for key in table:
            if key not in known:
                self.add(place, f"there is no `{prefix}{key}`{guess(key, known)}")


def guess(name: object, known: Iterable[str]) -> str:
    """': did you mean `length`? known: ...', the end of a sentence about an unknown name."""
    known = list(known)
    lower = {k.lower(): k for k in reversed(known)}
    close = difflib.get_close_matches(str(name).lower(), lower, n=1, cutoff=0.5)
    listed = ", ".join(f"`{k}`" for k in known) or "none"
    return (f": did you mean `{lower[close[0]]}`? " if close else ": choose from the ") + (
        f"known: {listed}"
    )
