"""The packages and who may import whom; the rooms of the engine on the way of one solve."""

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

BLUE, GREEN, ORANGE, GREY = "#dcebf7", "#e3f0d8", "#fbe6cf", "#efefef"


def box(panel: Axes, x: float, y: float, width: float, height: float, colour: str) -> None:
    """A rounded box by its lower left corner."""
    style = "round,pad=0,rounding_size=0.12"
    patch = FancyBboxPatch(
        (x, y), width, height, boxstyle=style, facecolor=colour, edgecolor="0.35", linewidth=0.9
    )
    panel.add_patch(patch)


def named(panel: Axes, x: float, y: float, width: float, colour: str, name: str, text: str) -> None:
    """A box with a bold name and a line of text."""
    box(panel, x, y, width, 0.86, colour)
    panel.text(x + 0.15, y + 0.56, name, fontsize=10.5, weight="bold", va="center")
    panel.text(x + 0.15, y + 0.25, text, fontsize=9, va="center", color="0.2")


def arrow(
    panel: Axes, start: tuple[float, float], end: tuple[float, float], bend: float = 0
) -> None:
    """An arrow, bent if asked for."""
    style = {"arrowstyle": "-|>", "color": "0.3", "connectionstyle": f"arc3,rad={bend}"}
    panel.annotate("", xy=end, xytext=start, arrowprops=style)


figure, (left, right) = plt.subplots(
    1, 2, figsize=(10.5, 6.6), width_ratios=(1, 1.35), layout="constrained"
)
left.set_title("packages: an arrow means \u201cimports\u201d", fontsize=11)
named(left, 0.9, 7.0, 4.2, ORANGE, "studies", "the antenna's problems, command, figures")
named(left, 0.0, 4.4, 2.8, BLUE, "ocp", "engine, knows no antenna")
named(left, 3.2, 4.4, 2.8, GREEN, "models", "mechanics, no optimiser")
named(left, 0.0, 1.8, 2.8, GREY, "CasADi, IPOPT", "derivatives and solver")
named(left, 3.2, 1.8, 2.8, GREY, "NumPy, SciPy", "arrays, linear algebra")
for start, end in (
    ((2.4, 7.0), (1.5, 5.26)),
    ((3.6, 7.0), (4.5, 5.26)),
    ((1.4, 4.4), (1.4, 2.66)),
    ((4.6, 4.4), (4.6, 2.66)),
    ((2.3, 4.4), (3.7, 2.66)),
    ((3.7, 4.4), (2.3, 2.66)),
):
    arrow(left, start, end)

right.set_title("rooms of the engine, in the order of one solve", fontsize=11)
rooms = (
    ("problem", "signals with units, phases, bounds, functionals"),
    ("mesh", "intervals, trajectories, the first guess"),
    ("transcription", "scaling, kernels, rows and columns of the program"),
    ("nlp", "IPOPT, failures said in words"),
    ("optimality", "multipliers, costates, Hamiltonian"),
    ("refinement", "errors between the points, switches, the next mesh"),
    ("verification", "independent replay, bounds between the points"),
    ("solution", "values at any time, save and load"),
)
for row, (name, text) in enumerate(rooms):
    named(right, 0.0, 8.4 - 1.12 * row, 5.4, BLUE, name, text)
    if row:
        arrow(right, (2.7, 8.4 - 1.12 * (row - 1)), (2.7, 9.26 - 1.12 * row))
arrow(right, (5.4, 8.83 - 1.12 * 5), (5.4, 8.83 - 1.12 * 2), bend=0.55)
right.text(6.35, 8.83 - 1.12 * 3.5, "until all\ntolerances\nare met", fontsize=9.5, va="center")
right.text(
    0, -0.6, "numerics serves all of them.  analysis asks for more than one solve.", fontsize=9.5
)
for panel, width in ((left, 6.1), (right, 7.4)):
    panel.set_xlim(-0.1, width)
    panel.set_ylim(-0.8, 9.5)
    panel.set_axis_off()
figure.savefig("architecture.png", dpi=130)
