"""The warning of the module."""

from __future__ import annotations


class ImucalWarning(UserWarning):
    """What stops nothing and should be known."""
