"""Results that are a part of the program's JSON."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, eq=False)
class Document:
    """A result: its main figures are fields, and all of the JSON is there by key."""

    _document: dict[str, Any] = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """All of it, as ``json.loads`` reads the program's JSON; a copy."""
        return copy.deepcopy(self._document)

    def __getitem__(self, key: str) -> Any:
        return copy.deepcopy(self._document[key])

    def __contains__(self, key: object) -> bool:
        return key in self._document

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._document == other._document

    __hash__ = None  # type: ignore[assignment]
