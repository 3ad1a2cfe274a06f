"""The packages and who may import whom; the packages of the engine on the way of one solve."""

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

BLUE, GREEN, ORANGE, GREY = "#dcebf7", "#e3f0d8", "#fbe6cf", "#efefef"
HEIGHT = 0.86  # of a box


def box(panel: Axes, x: float, y: float, width: float, height: float, colour: str) -> None:
    """A rounded box by its lower left corner."""
    style = "round,pad=0,rounding_size=0.12"
    patch = FancyBboxPatch(
        (x, y), width, height, boxstyle=style, facecolor=colour, edgecolor="0.35", linewidth=0.9
    )
    panel.add_patch(patch)


def named(panel: Axes, x: float, y: float, width: float, colour: str, name: str, text: str) -> None:
    """A box with a bold name and a line of text."""
    box(panel, x, y, width, HEIGHT, colour)
    panel.text(x + 0.15, y + 0.56, name, fontsize=10, weight="bold", va="center")
    panel.text(x + 0.15, y + 0.25, text, fontsize=8.5, va="center", color="0.2")


def arrow(
    panel: Axes, start: tuple[float, float], end: tuple[float, float], bend: float = 0
) -> None:
    """An arrow, bent if asked for."""
    style = {"arrowstyle": "-|>", "color": "0.3", "connectionstyle": f"arc3,rad={bend}"}
    panel.annotate("", xy=end, xytext=start, arrowprops=style)


figure, (left, right) = plt.subplots(
    1, 2, figsize=(11.5, 7.4), width_ratios=(1, 1.75), layout="constrained"
)
left.set_title("packages: an arrow means \u201cimports\u201d", fontsize=11)
named(left, 0.9, 7.6, 4.2, ORANGE, "studies", "the antenna's problems, command, figures")
named(left, 0.0, 5.0, 2.8, BLUE, "ocp", "optimal control; no antenna")
named(left, 3.2, 5.0, 2.8, GREEN, "models", "mechanics; no optimiser")
named(left, 0.0, 2.4, 2.8, GREY, "CasADi, IPOPT", "derivatives and solver")
named(left, 3.2, 2.4, 2.8, GREY, "NumPy, SciPy", "arrays, linear algebra")
for start, end in (
    ((2.4, 7.6), (1.5, 5.86)),
    ((3.6, 7.6), (4.5, 5.86)),
    ((1.4, 5.0), (1.4, 3.26)),
    ((4.6, 5.0), (4.6, 3.26)),
    ((2.3, 5.0), (3.7, 3.26)),
    ((3.7, 5.0), (2.3, 3.26)),
):
    arrow(left, start, end)

# ----- one solve, from top to bottom

right.set_title("one solve: its stages, and the packages of ocp that do them", fontsize=11)
LEFT, STAGE = 0.0, 4.5
stages = (
    (10.3, ORANGE, "Problem", "problem: what the user states"),
    (9.0, BLUE, "reformulate", "reformulate: kinks of costs become limits"),
    (7.7, BLUE, "first start", "mesh: first mesh and guess"),
    (3.3, BLUE, "verify", "verification: replay, values between points"),
    (2.0, BLUE, "report", "verdict, optimality: costates, sensitivities"),
    (0.7, ORANGE, "Solution", "solution: values, tables, plots, files"),
)
for y, colour, name, text in stages:
    named(right, LEFT, y, STAGE, colour, name, text)

# refine is a loop of four steps
box(right, LEFT, 4.6, 10.6, 2.65, "#f4f9fd")
right.text(0.15, 6.95, "refine", fontsize=10, weight="bold", va="center")
right.text(1.15, 6.95, "refinement: until all tolerances are met", fontsize=8.5, va="center")
named(right, 0.25, 5.8, 4.6, BLUE, "solve", "scaling, transcription, nlp: IPOPT")
named(right, 5.75, 5.8, 4.6, BLUE, "estimate", "estimates: errors between the points")
named(right, 5.75, 4.75, 4.6, BLUE, "stop?", "endings: accurate, or nothing to gain")
named(right, 0.25, 4.75, 4.6, BLUE, "next mesh", "policies: cut, degree, breakpoints")
arrow(right, (4.85, 6.23), (5.75, 6.23))
arrow(right, (8.05, 5.8), (8.05, 5.61))
arrow(right, (5.75, 5.18), (4.85, 5.18))
arrow(right, (2.55, 5.61), (2.55, 5.8))

for above, below in ((10.3, 9.86), (9.0, 8.56), (7.7, 7.25), (4.6, 4.16), (3.3, 2.86), (2.0, 1.56)):
    arrow(right, (2.25, above), (2.25, below))

# where the replay misses although each interval holds
arrow(right, (4.5, 3.73), (6.4, 4.6), bend=0.3)
right.text(6.0, 3.7, "once more at most, if errors add up:", fontsize=8.5, color="0.2")
right.text(6.0, 3.35, "the dynamics are held more strictly", fontsize=8.5, color="0.2")

# ----- what is asked around a solve
named(right, 6.0, 0.7, 4.6, GREEN, "certify", "diagnostics: findings, a second solve")
arrow(right, (4.5, 1.13), (6.0, 1.13))
named(
    right, 6.0, 9.0, 4.6, GREEN, "ask for several solves", "analysis: starts, families, fronts, ..."
)
arrow(right, (6.0, 9.6), (4.5, 10.5), bend=0.15)
right.text(6.0, 8.45, "numerics (schemes, polynomials,", fontsize=8.5, color="0.2")
right.text(6.0, 8.1, "integrators) serves all of them", fontsize=8.5, color="0.2")
for panel, width in ((left, 6.1), (right, 10.8)):
    panel.set_xlim(-0.1, width)
    panel.set_ylim(0.4, 11.3)
    panel.set_axis_off()
figure.savefig("architecture.png", dpi=130)
