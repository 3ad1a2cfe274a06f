"""A result as one page: all of it in one file, which asks nothing of a network."""

from __future__ import annotations

import base64
import contextlib
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from ocp.arrays import Array
from studies import registry
from studies.common.charts import Chart, charts_of_arrays
from studies.common.drawing import LAWS
from studies.common.exit_codes import StudyError
from studies.common.result import Result
from studies.common.scene.moving_picture import MovingPicture
from studies.common.study import Study, placed
from studies.report import tables
from studies.report.html import document, first_upper
from studies.report.still import snapshots, tension_picture

SHARES = (0.0, 0.4, 0.6, 1.0)  # of the duration, of the still pictures of a motion

# what results that are fronts show, which is something else than their mechanism's motion
_FRONT = "studies.fronts.page"


@dataclass(frozen=True, eq=False)
class Shown:
    """The parts of a page in addition to the numbers of a result.

    Attributes
    ----------
    laws : names, in the order of their colours.
    charts : all curves.
    picture : what moves, or None.
    figures : PNG files of the figures that stand in the page in their place, by name, in base 64.
    """

    laws: tuple[str, ...]
    charts: tuple[Chart, ...]
    picture: MovingPicture | None
    figures: Mapping[str, str] = field(default_factory=dict)

    @property
    def drawn(self) -> set[str]:
        """The laws that have a curve."""
        return {curve.law for chart in self.charts for curve in chart.curves}


def shown(result: Result) -> Shown:
    """Curves and motion of a result, as its kind has them."""
    study, mechanism = registry.study_of(result.kind), registry.mechanism_of(result.kind)
    if study is not None and study.drawn and result.arrays:
        return Shown((), (), None, dict(_drawings(result, study)))
    name = _FRONT if "axes" in result.details else "" if mechanism is None else mechanism.page
    charts: tuple[Chart, ...] = charts_of_arrays(result)
    picture = None
    if result.arrays and name:
        module: Any = import_module(name)
        with contextlib.suppress(StudyError):  # the study is not known any more: its arrays are
            charts, picture = module.charts(result), module.scene(result)
    named = [curve.law for chart in charts for curve in chart.curves]
    if picture is not None:
        named += [law.name for law in picture.laws]
    return Shown(_in_order((*result.laws, *named)), charts, picture)


def _drawings(result: Result, study: Study) -> Iterator[tuple[str, str]]:
    assert study.figures is not None
    for name, figure in placed(study.figures)(result):
        stream = io.BytesIO()
        figure.savefig(stream, format="png")
        yield name, base64.b64encode(stream.getvalue()).decode()


def _in_order(names: Iterable[str]) -> tuple[str, ...]:
    """The result's own law, then the others as the figures order them: so are their colours."""
    laws = tuple(dict.fromkeys(names))
    known = {name: place for place, name in enumerate(LAWS)}
    return (*laws[:1], *sorted(laws[1:], key=lambda name: known.get(name, len(known))))


def page(result: Result, input_text: str = "") -> str:
    """The page of a result.

    Parameters
    ----------
    input_text : str
        The study as it was run; its configuration stands there if it is not known.
    """
    what, mechanism = shown(result), registry.mechanism_of(result.kind)
    return document(
        "report.html",
        title_of(result),
        payload(what),
        result=result,
        shown=what,
        the=tables,
        kind=mechanism.title if mechanism else result.kind or "unknown kind of study",
        made=str(result.provenance.get("made", ""))[:10],
        model=(mechanism.model if mechanism else ()) or ("See the exact input below.",),
        input=input_text or json.dumps(result.configuration, indent=2, ensure_ascii=False),
        stills=lambda picture: snapshots(picture, SHARES),
        tension_picture=tension_picture,
    )


def title_of(result: Result) -> str:
    """What the browser calls the page."""
    return first_upper(result.question or "a result that is incomplete")


class _Arrays:
    """The arrays of a page, each stored once."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._places: dict[str, int] = {}

    def add(self, values: Any, kind: str = "f") -> int:
        """Store an array as 32-bit (f) or 64-bit (d) floats or as 16-bit indices (i)."""
        types = {"f": "<f4", "d": "<f8", "i": "<u2"}
        raw = np.ascontiguousarray(values, dtype=types[kind]).tobytes()
        text = f"{kind}:{base64.b64encode(raw).decode()}"
        if text not in self._places:
            self._places[text] = len(self.texts)
            self.texts.append(text)
        return self._places[text]


def payload(what: Shown) -> dict[str, Any]:
    """All numbers of a page, as its script reads them."""
    arrays = _Arrays()
    charts = [_chart(chart, what.laws, arrays) for chart in what.charts]
    scene = None if what.picture is None else _scene(what.picture, what.laws, arrays)
    return {"laws": what.laws, "charts": charts, "scene": scene, "arrays": arrays.texts}


def _chart(chart: Chart, laws: Sequence[str], arrays: _Arrays) -> dict[str, Any]:
    def described(axis: Any) -> dict[str, str]:
        return {"key": axis.key, "title": axis.title, "unit": axis.unit, "label": axis.label}

    return {
        "key": chart.key,
        "title": chart.title,
        "unit": chart.unit,
        "path": chart.path,
        "axes": [described(axis) for axis in chart.axes],
        "curves": [
            {
                "law": laws.index(curve.law),
                # places are told apart to the last digit, values to seven
                "places": {key: arrays.add(values, "d") for key, values in curve.places.items()},
                "values": arrays.add(_finite(curve.values)),
            }
            for curve in chart.curves
        ],
        "levels": [{"name": level.name, "value": level.value} for level in chart.levels],
    }


def _finite(values: Array) -> Array:
    """JSON and charts have no room for infinities."""
    return np.where(np.isfinite(values), values, np.nan)


def _scene(picture: MovingPicture, laws: Sequence[str], arrays: _Arrays) -> dict[str, Any]:
    # rows of a table are many, and a thousandth of a millimetre will do for their pixels
    kind = "f" if picture.weights is None else "d"

    def optional(values: Array | None, kind: str = "d") -> int | None:
        return None if values is None else arrays.add(values, kind)

    return {
        "title": picture.title,
        "flat": picture.flat,
        "size": picture.size,
        "points": picture.shapes.shape[1],
        "shapes": arrays.add(picture.shapes, kind),
        "straight": optional(picture.straight, kind),
        "parameter": arrays.add(picture.parameter, "d"),
        "weights": optional(picture.weights),
        "slopes": optional(picture.slopes),
        "centre": picture.centre,
        "strands": [
            {"kind": strand.kind, "pairs": arrays.add(strand.pairs, "i")}
            for strand in picture.strands
        ],
        "slack": dict(picture.slack),
        "tension": None
        if picture.tension is None
        else {
            "paths": [arrays.add(path, "i") for path in picture.tension.paths],
            "exponents": arrays.add(picture.tension.exponents, "d"),
        },
        "laws": [
            {
                "law": laws.index(law.name),
                "times": arrays.add(law.times, "d"),
                "values": arrays.add(law.values, "d"),
                "rates": arrays.add(law.rates, "d"),
                "force": arrays.add(law.force) if law.force.size else None,
                "rope": arrays.add(law.rope_length) if law.rope_length.size else None,
            }
            for law in picture.laws
        ],
    }
