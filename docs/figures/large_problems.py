"""Time of the engine by that of the cheapest fixed mesh that is as right, on large problems."""

import json
from pathlib import Path
from statistics import median

import matplotlib.pyplot as plt

# written by `python -m benchmarks.large --output benchmarks/large/measured.json`
MEASURED = Path(__file__).parents[2] / "benchmarks" / "large" / "measured.json"

# what the engine was asked for, and the accuracy that the fixed mesh has to have
ASKED = {"accuracy=0.001": 1e-3, "accuracy=0.0001": 1e-4, "defaults": 1e-4}


def ratio(rows: list[dict], how: str) -> float | None:
    """Processor time of an answer by that of the cheapest fixed mesh; None without either."""
    fixed = [
        row["seconds"]
        for row in rows
        if row["how"].endswith("intervals") and row["error"] <= ASKED[how]
    ]
    taken = [row["seconds"] for row in rows if row["how"] == how and row["error"] >= 0]
    return taken[0] / min(fixed) if taken and fixed else None


def main() -> None:
    """Draw the ratios of all problems in a column for each question."""
    problems = json.loads(MEASURED.read_text("utf-8"))
    figure, axes = plt.subplots(figsize=(8.0, 4.4), layout="constrained")
    for place, how in enumerate(ASKED):
        found = {name: value for name, rows in problems.items() if (value := ratio(rows, how))}
        label = 0.0
        for name, value in sorted(found.items(), key=lambda item: item[1]):
            axes.plot(place, value, "o", color="C0", alpha=0.7)
            # names stand one above the other
            label = max(value, label * 1.13)
            axes.text(place + 0.05, label, name, fontsize=7, va="center")
        middle = median(found.values())
        axes.plot([place - 0.1, place + 0.02], [middle, middle], color="C1", linewidth=2)
        told = f"median {middle:.1f}\nof {len(found)}"
        axes.text(place - 0.12, middle, told, ha="right", va="center", fontsize=8)
    axes.set_yscale("log")
    axes.set_xlim(-0.6, len(ASKED) - 0.3)
    axes.set_xticks(range(len(ASKED)), ["accuracy=1e-3", "accuracy=1e-4", "defaults"])
    axes.set_ylabel("processor time, by the cheapest fixed mesh's")
    axes.grid(axis="y", alpha=0.3)
    figure.savefig("large_problems.png", dpi=150)


if __name__ == "__main__":
    main()
