"""Diagnoses: which effect a simulator lacks."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Optional, Union

from . import _native
from ._calibration import Calibration
from ._document import Document
from ._recording import Path, Recording


@dataclass(frozen=True, eq=False)
class Cause(Document):
    """An effect that a diagnosis asserts."""

    #: Its id, as in ``imucal diagnose --list``.
    effect: str
    probability: float
    #: Effects that this recording cannot distinguish from it.
    equivalents: list[str]
    #: Each with ``name``, ``value``, ``std_error`` and ``unit``.
    parameters: list[dict[str, Any]]
    #: Whether it matters.
    material: bool
    #: Share of the gap that it closes, and its 95 % interval.
    gap_closed: Optional[float]
    gap_closed_ci95: Optional[list[float]]


@dataclass(frozen=True, eq=False)
class Diagnosis(Document):
    """A diagnosis; its keys are those of ``imucal diagnose --json``."""

    #: Byte for byte what ``imucal diagnose --json`` writes.
    json: str = field(repr=False)
    #: File name of the recording.
    recording: str
    #: ``explained``, ``ambiguous``, ``partly``, ``unknown``, ``none`` or ``not-testable``.
    verdict: str
    #: Why there is no better answer, or what else should be known.
    remarks: list[str]
    warnings: list[str]
    #: Effects that are asserted, most certain first.
    causes: list[Cause]
    #: Share of the gap that all causes close, and its 95 % interval.
    gap_closed_total: Optional[float]
    gap_closed_total_ci95: Optional[list[float]]
    #: Formulas that are proposed where no effect explains the gap, as a file for ``effects``; empty where none is.
    proposals_toml: str = field(repr=False)
    #: With ``html=True`` the page, byte for byte what ``--html`` writes; it has the hash of the recording's file.
    html: Optional[str] = field(repr=False)


def diagnose(
    recording: Recording,
    *,
    sim: Union[Recording, Path, None] = None,
    sim_topic: Optional[str] = None,
    model: Optional[Calibration] = None,
    without: Iterable[str] = (),
    effects: Optional[Path] = None,
    frozen: bool = False,
    watch: Optional[Path] = None,
    html: bool = False,
) -> Diagnosis:
    """Finds where a recording and a simulator disagree, the cause, and the share that it explains.

    ``sim`` is a simulator's ideal stream of the same movement, ``sim_topic`` one of several in it; without it the
    recording's own reference is used. ``model`` is the unit's present calibration, ``without`` names effects that are no
    candidates, ``effects`` is a file of your own ones, which ``frozen`` confirms as the file has found them, and
    ``watch`` the summary of a device's drift watch. ``html`` makes the page, too.
    """
    if sim is None or isinstance(sim, Recording):
        stream = None if sim is None else sim._native
    else:
        stream, sim_topic = _native.read_stream(os.fspath(sim), sim_topic)
    text, proposals, page = _native.diagnose(
        recording._native,
        stream,
        sim_topic,
        None if model is None else model._native,
        list(without),
        None if effects is None else os.fspath(effects),
        frozen,
        None if watch is None else os.fspath(watch),
        html,
    )
    found: dict[str, Any] = json.loads(text)
    return Diagnosis(
        found,
        text,
        found["recording"],
        found["verdict"],
        found["remarks"],
        found["warnings"],
        [_cause(cause) for cause in found["causes"]],
        found["gap_closed_total"],
        found["gap_closed_total_ci95"],
        proposals,
        page,
    )


def _cause(found: dict[str, Any]) -> Cause:
    keys = (
        "effect",
        "probability",
        "equivalents",
        "parameters",
        "material",
        "gap_closed",
        "gap_closed_ci95",
    )
    return Cause(found, *(found[key] for key in keys))
