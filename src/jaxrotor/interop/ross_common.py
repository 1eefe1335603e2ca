"""What both ways between ROSS and jaxrotor share."""

from typing import Any

from ..core.errors import InputError, MissingExtraError

# Names in a sentence.
_TOLD = 3


def imported() -> Any:
    try:
        import ross  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise MissingExtraError(
            f"ROSS cannot be imported ({error}): pip install 'jaxrotor[interop]'"
        ) from None
    return ross


class Faults:
    """What cannot be carried: one sentence for each kind, with the elements that it is about."""

    def __init__(self):
        self.found: dict[str, list[str]] = {}

    def add(self, name: str, words: str) -> None:
        self.found.setdefault(words, []).append(f"`{name}`")

    def tell(self) -> None:
        sentences = []
        for words, names in self.found.items():
            more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
            sentences.append(f"{', '.join(names[:_TOLD])}{more}: {words}")
        if sentences:
            raise InputError(*sentences)
