"""The parts of a page, each an element, from a result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from studies import registry
from studies.common.charts import Chart
from studies.common.columns import flat
from studies.common.comparison_table import TableRow
from studies.common.console import number
from studies.common.parameters import ParameterLine, stated_parameters
from studies.common.result import Result
from studies.common.study import placed
from studies.report import words
from studies.report.html import Content, Element, element, identifier, table
from studies.report.still import chart_picture

MANY = 5  # costs that fit a narrow card


def section(title: str, *content: Content) -> Element:
    """A part with a heading that the navigation links to."""
    key = identifier(title)
    return element("section", element("h2", title, id=key), *content, aria_labelledby=key)


def paragraphs(sentences: Sequence[str]) -> list[Element]:
    """A paragraph for each."""
    return [element("p", sentence) for sentence in sentences]


def bullets(sentences: Sequence[str]) -> Element:
    """A list of sentences."""
    return element("ul", [element("li", sentence) for sentence in sentences])


def title_of(result: Result) -> str:
    """What the browser calls the page."""
    question = result.question or "a result that is incomplete"
    return f"{question[:1].upper()}{question[1:]}"


def heading(result: Result) -> Element:
    """Kind and question."""
    mechanism = registry.mechanism_of(result.kind)
    kind = mechanism.title if mechanism else result.kind or "unknown kind of study"
    made = str(result.provenance.get("made", ""))[:10]
    return element(
        "header",
        element(
            "p", f"{kind}, result of antenna-ocp" + (f", {made}" if made else ""), class_="kind"
        ),
        element("h1", title_of(result)),
    )


def missing(result: Result) -> Element | None:
    """What an incomplete result has not."""
    if not result.missing:
        return None
    parts = ", ".join(result.missing)
    return element(
        "p",
        element("strong", "Incomplete. "),
        f"Missing: {parts}. The page shows what there is.",
        class_="missing",
        role="note",
    )


def summary(result: Result) -> Element:
    """For a person who decides: answer, verdict, gains and costs."""
    word, mood = words.KINDS[result.verdict.kind]
    failed = any(not check.passed for check in result.checks)
    cards = [
        element(
            "div",
            element("h2", "Answer"),
            paragraphs(words.answer(result)),
            class_="card wide",
        ),
        element(
            "div",
            element("h2", "May I believe it?"),
            element(
                "p",
                element("span", word, class_="word"),
                f". {result.verdict.sentence[:1].upper()}{result.verdict.sentence[1:]}.",
            ),
            bullets(words.rests_on(result)),
            class_=f"card {'bad' if failed else mood}",
        ),
    ]
    if words.compared(result):
        cards += [_gains_card(result), _costs_card(result)]
    return element("div", cards, class_="cards", id="summary")


def _gains_card(result: Result) -> Element:
    gains = words.gains(result)
    text = bullets(gains) if gains else element("p", "Nothing: no quantity is clearly better.")
    return element("div", element("h2", "What does it buy?"), text, class_="card")


def _costs_card(result: Result) -> Element:
    costs = words.costs(result)
    text: Content = element(
        "p", "Nothing: no quantity is more than 10 % worse than the better law."
    )
    if costs:
        text = bullets(costs)
    long = " wide" if len(costs) > MANY else ""
    mood = "bad" if words.outstanding(result) else "unsure" if costs else "good"
    return element("div", element("h2", "What does it cost?"), text, class_=f"card {mood}{long}")


def requirement(result: Result) -> Element:
    """What was asked, with all caps."""
    caps = [row for row in result.table if row.cap is not None]
    rows = [(row.title, row.unit, number(row.cap, 6)) for row in caps]
    goals = [row.title for row in result.table if row.minimised]
    sentences = ["The question is not recorded."]
    if result.question:
        sentences = [title_of(result) + ("" if result.question.endswith("?") else ".")]
    if goals:
        sentences.append(f"To be as small as possible: {', '.join(goals)}.")
    return section(
        "Requirement",
        paragraphs(sentences),
        table("Caps that hold at all times", ("quantity", "unit", "cap"), rows, key="caps")
        if rows
        else element("p", "There are no caps in its table."),
    )


def model(result: Result) -> Element:
    """What was computed with."""
    mechanism = registry.mechanism_of(result.kind)
    sentences = () if mechanism is None else mechanism.model
    return section("Model", paragraphs(sentences or ("See the exact input below.",)))


def parameters(result: Result) -> Element:
    """Every parameter of the model with its source."""
    rows = [
        (
            line.name,
            element("span", line.meaning),
            line.unit,
            number(line.value, 6) if isinstance(line.value, float) else str(line.value),
            line.source,
        )
        for line in _parameter_lines(result)
    ]
    head = ("parameter", "meaning", "unit", "value", "source")
    if not rows:
        return section("Parameters", element("p", "See the exact input below."))
    made = table("Parameters of the model", head, rows, key="parameters")
    for row in made.iter("tr"):
        cells = list(row)
        for cell in (cells[1], cells[4]):
            cell.set("class", "text")
    return section("Parameters", made)


def _parameter_lines(result: Result) -> list[ParameterLine]:
    """The parameters as the mechanism has them, or else all keys of the study's own tables."""
    study, mechanism = registry.study_of(result.kind), registry.mechanism_of(result.kind)
    if mechanism is not None and mechanism.parameters is not None:
        lines: list[ParameterLine] = placed(mechanism.parameters)(result.configuration)
        return lines
    tables = {} if study is None else study.tables()
    values = result.configuration
    return [
        line
        for name, kind in tables.items()
        for line in stated_parameters(kind, values.get(name, {}) if name else values)
    ]


def results(result: Result) -> list[Element]:
    """The table of all quantities."""
    if not result.table:
        return [element("p", "The table is missing.")]
    capped = any(row.cap is not None for row in result.table)
    bounded = any(row.bound is not None for row in result.table)
    head = ["quantity", "unit", *result.laws, *["cap"] * capped, *["bound"] * bounded]
    rows = [_row(row, result, capped, bounded) for row in result.table]
    notes = []
    if any(row.minimised for row in result.table):
        notes.append("In bold: what is minimised.")
    if bounded:
        notes.append("Bound: no motion is better, each row on its own.")
    if any(row.broken_by for row in result.table):
        notes.append("A value with ! breaks a cap, so that its law is no candidate.")
    classes = ["minimised" if row.minimised else "" for row in result.table]
    return [table("All quantities", head, rows, key="quantities", notes=notes, classes=classes)]


def _row(row: TableRow, result: Result, capped: bool, bounded: bool) -> list[Content]:
    cells: list[Content] = [row.title, row.unit]
    for law in result.laws:
        value = number(row.values.get(law), 6)
        broken = law in row.broken_by
        cells.append(element("span", f"{value} !", class_="broken") if broken else value)
    cells += [number(row.cap, 6)] * capped + [number(row.bound, 6)] * bounded
    return cells


def curves(charts: Sequence[Chart], laws: Sequence[str]) -> list[Element]:
    """All charts: still pictures that the script replaces."""
    legend = element(
        "ul",
        [
            element("li", element("span", class_=f"swatch law-{k % 8}", aria_hidden="true"), law)
            for k, law in enumerate(laws)
            if any(curve.law == law for chart in charts for curve in chart.curves)
        ],
        class_="legend",
        id="curves-legend",
        aria_label="laws",
    )

    # the meaning stands below a title only where it says more
    figures = [
        element(
            "figure",
            element(
                "figcaption",
                chart.label,
                element("span", chart.meaning, class_="note") if _adds(chart) else None,
            ),
            element("div", chart_picture(chart, laws), class_="still"),
            element("div", class_="live"),
            class_="chart",
            data_chart=chart.key,
        )
        for chart in charts
    ]

    controls = element("div", id="chart-controls", class_="controls live")
    return [controls, legend, element("div", figures, class_="grid")]


def _adds(chart: Chart) -> bool:
    """Whether the meaning of a chart says more than its title."""
    return bool(chart.meaning) and chart.meaning not in chart.title


def verification(result: Result) -> Element:
    """What was checked by other means, how the search went, and how exact it is."""
    content: list[Content] = []
    if result.checks:
        rows = [
            (
                check.name,
                check.unit,
                number(check.value, 6),
                number(check.limit, 6),
                "passed" if check.passed else element("span", "FAILED", class_="broken"),
            )
            for check in result.checks
        ]
        head = ("check", "unit", "value", "limit", "")
        content.append(table("Checks", head, rows, key="checks"))
    else:
        content.append(element("p", "There are no checks: the study did not come so far."))

    accuracy = result.details.get("accuracy")
    if isinstance(accuracy, Mapping) and accuracy:
        rows_of = [(key, _shown(value)) for key, value in _leaves(accuracy)]
        content.append(table("Accuracy", ("what", "value"), rows_of, key="accuracy"))
    for key, title in (("starts", "Starts of the search"), ("rounds", "Rounds")):
        content += _records(result.details.get(key), title, key)
    engine = result.details.get("engine")
    if isinstance(engine, Mapping):
        content += _records(engine.get("rounds"), "Mesh iterations of the best start", "mesh")
    return section("Verification by other means", content)


def further(result: Result, key: str, title: str) -> Element | None:
    """A part that some results have, such as load cases or margins."""
    found = result.details.get(key)
    if not found:
        return None
    if isinstance(found, Mapping):
        rows = [(name, _shown(value)) for name, value in _leaves(found)]
        return section(title, table(title, ("what", "value"), rows, key=key))
    records = _records(found, title, key)
    return section(title, records) if records else None


def _records(found: Any, title: str, key: str) -> list[Element]:
    """A table of a list of records; none if it is no such list."""
    if not (isinstance(found, list) and found and all(isinstance(one, Mapping) for one in found)):
        return []
    head = list(dict.fromkeys(name for one in found for name in one))
    rows = [[_shown(one.get(name), 4) for name in head] for one in found]
    numbered = [[str(k), *row] for k, row in enumerate(rows, start=1)]
    made = table(title, ["", *(name.replace("_", " ") for name in head)], numbered, key=key)
    made.set("class", "table numbered")
    return [made]


def _leaves(content: Mapping[str, Any], head: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in content.items():
        name = f"{head}{key}".replace("_", " ")
        found += _leaves(value, f"{name}: ") if isinstance(value, Mapping) else [(name, value)]
    return found


def _shown(value: Any, digits: int = 6) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return number(value, digits) if math.isfinite(value) else "–"
    if isinstance(value, list):
        return ", ".join(_shown(item, digits) for item in value)
    return str(value)


def limits(result: Result) -> Element:
    """Where the result ends."""
    return section("Limits", bullets(words.limits(result)))


def exact_input(text: str) -> Element:
    """The study as it was run."""
    return section(
        "Exact input",
        element("p", "Run again, this gives the same result."),
        element("button", "Copy", type="button", data_copies="input", hidden=True),
        element("pre", text, id="input", tabindex="0"),
    )


def versions(result: Result) -> Element:
    """What the result was made with."""
    rows = [(name, str(value)) for name, value in flat(result.provenance).items()]
    if not rows:
        return section("Versions", element("p", "They are not recorded."))
    return section("Versions", table("Made by", ("what", "value"), rows, key="versions"))
