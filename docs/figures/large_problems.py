"""Time of the engine by that of the cheapest fixed mesh that is as right, on large problems."""

import json
from pathlib import Path
from statistics import median

import matplotlib.pyplot as plt

# written by `python -m benchmarks.large --peer --output benchmarks/large/measured.json`
MEASURED = Path(__file__).parents[2] / "benchmarks" / "large" / "measured.json"

# what the engine was asked for, and the accuracy that the fixed mesh has to have
ASKED = {"accuracy=0.001": 1e-3, "accuracy=0.0001": 1e-4, "defaults": 1e-4}


def cheapest(rows: list[dict], by: str, accuracy: float) -> float | None:
    """Least processor time on a fixed mesh that is right to an accuracy; None if none is."""
    taken = [row["seconds"] for row in rows if row["by"] == by and row["error"] <= accuracy]
    return min(taken, default=None)


def ratios(problems: dict[str, list[dict]], by: str, how: str) -> dict[str, float]:
    """Processor times by those of the engine on the cheapest fixed mesh, by problem."""
    found = {}
    for name, rows in problems.items():
        least = cheapest(rows, "fixed", ASKED[how])
        taken = cheapest(rows, by, ASKED[how])
        if by == "engine":
            taken = next((r["seconds"] for r in rows if r["how"] == how and r["error"] >= 0), None)
        if taken and least:
            found[name] = taken / least
    return found


def draw(axes: plt.Axes, place: float, found: dict[str, float], color: str) -> None:
    """A column of named points, and their median."""
    label = 0.0
    for name, value in sorted(found.items(), key=lambda item: item[1]):
        axes.plot(place, value, "o", color=color, alpha=0.7)
        # names stand one above the other
        label = max(value, label * 1.15)
        axes.text(place + 0.04, label, name, fontsize=7, va="center")
    middle = median(found.values())
    axes.plot([place - 0.08, place + 0.02], [middle, middle], color="black", linewidth=2)
    told = f"median {middle:.1f}\nof {len(found)}"
    axes.text(place - 0.1, middle, told, ha="right", va="center", fontsize=8)


def main() -> None:
    """Draw the ratios of all problems in a column for each question."""
    problems = json.loads(MEASURED.read_text("utf-8"))
    figure, axes = plt.subplots(figsize=(12.0, 6.0), layout="constrained")
    columns = [
        ("yapss", "accuracy=0.001", "yapss,\nright to 1e-3"),
        ("engine", "accuracy=0.001", "ocp,\naccuracy=1e-3"),
        ("yapss", "accuracy=0.0001", "yapss,\nright to 1e-4"),
        ("engine", "accuracy=0.0001", "ocp,\naccuracy=1e-4"),
        ("engine", "defaults", "ocp,\ndefaults"),
    ]
    for place, (by, how, _) in enumerate(columns):
        draw(axes, place, ratios(problems, by, how), "C1" if by == "yapss" else "C0")
    axes.axhline(1.0, color="0.6", linewidth=1, zorder=0)
    axes.set_yscale("log")
    axes.set_xlim(-0.6, len(columns) - 0.3)
    axes.set_xticks(range(len(columns)), [title for *_, title in columns])
    axes.set_ylabel("processor time, by the cheapest fixed mesh's")
    axes.grid(axis="y", alpha=0.3)
    figure.savefig("large_problems.png", dpi=150)


if __name__ == "__main__":
    main()
