"""Collects what is wrong with a study, so that the user sees all of it at once."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, field

# A list of what is known helps up to this length, where the right name is guessed already.
_LISTED = 16


@dataclass
class Faults:
    """The sentences found so far."""

    sentences: list[str] = field(default_factory=list)

    def add(self, place: str, predicate: str) -> None:
        """`place` is where in the file, such as `line "shaft 2"`; `predicate` says the rest."""
        self.sentences.append(f"`{place}`: {predicate}")

    def unknown_keys(
        self, place: str, table: dict, known: Iterable[str], prefix: str = ""
    ) -> set[str]:
        """Refuses every key of `table` that is not among the known.

        Returns those that were probably meant, so that nobody is told they are missing as well.
        """
        known, meant = list(known), set()
        for key in table:
            if key not in known:
                self.add(place, f"there is no `{prefix}{key}`{guess(key, known)}")
                meant.add(nearest(key, known))
        return {key for key in meant if key is not None and key not in table}


def nearest(name: object, known: Iterable[str]) -> str | None:
    """The known name that `name` looks like."""
    lower = {k.lower(): k for k in reversed(list(known))}
    close = difflib.get_close_matches(str(name).lower(), lower, n=1, cutoff=0.5)
    return lower[close[0]] if close else None


def guess(name: object, known: Iterable[str]) -> str:
    """': did you mean `length`? known: ...', the end of a sentence about an unknown name."""
    known = list(known)
    close = nearest(name, known)
    listed = ", ".join(f"`{k}`" for k in known) or "none"
    if close is None:
        return f": choose from the known: {listed}"
    return f": did you mean `{close}`?" + (f" known: {listed}" if len(known) <= _LISTED else "")
