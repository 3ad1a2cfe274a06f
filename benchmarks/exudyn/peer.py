"""Chains of free hinges in Exudyn: the same meshes of ANCF cable elements.

Exudyn is imported on first use, its build without range checks where the processor allows it.
Element and quadrature are those of `models.ancf.element`. Exudyn's curvature is the exact one, so
the two converged meshes differ slightly.
"""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter, process_time
from typing import Any, Literal

import numpy as np

from models.ancf.chain import Chain
from models.arrays import Array
from studies.common.exit_codes import StudyError

Scheme = Literal["generalised alpha", "trapezoidal", "Verlet"]
ROOT_MASS = 1e8  # [kg] that holds the root where the scheme is explicit


@dataclass(frozen=True)
class Setting:
    """How Exudyn integrates.

    Attributes
    ----------
    scheme : str
        Generalised alpha (spectral radius 0.9), trapezoidal rule on index 2, or explicit.
    tolerance : float
        Relative, of the Newton iterations; unused where explicit.
    """

    scheme: Scheme
    tolerance: float = 1e-7

    @property
    def name(self) -> str:
        """For the table."""
        explicit = self.scheme == "Verlet"
        return self.scheme if explicit else f"{self.scheme}, Newton {self.tolerance:.0e}"


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated chain and what it took.

    Attributes
    ----------
    ends : ndarray, shape (L, 2, m)
        Position of each link's end at the samples [m].
    steps : int
        Accepted time steps.
    seconds, processor : float
        Wall clock and processor time of the time stepping [s].
    setup : float
        Wall clock of what comes before it [s].
    """

    ends: Array
    steps: int
    seconds: float
    processor: float
    setup: float


def load() -> Any:
    """Return the package Exudyn.

    Raises
    ------
    StudyError
        If it is not installed.
    """
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # type: ignore[attr-defined]  # read by exudyn when it is imported
    try:
        with redirect_stdout(sys.stderr):
            import exudyn
    except ImportError as error:
        raise StudyError(
            "Exudyn is not installed; install it with: "
            "pip install -r benchmarks/exudyn/requirements.txt"
        ) from error
    return exudyn


def run(chain: Chain, duration: float, sample: float, step: float, setting: Setting) -> Run:
    """Let a straight chain fall from rest and time the steps.

    Parameters
    ----------
    chain : Chain
        Pinned, without particles, hub and damping.
    duration, sample, step : float
        [s]; the steps divide the samples.
    setting : Setting
        How Exudyn integrates.

    Raises
    ------
    StudyError
        If Exudyn is not installed, or stops short.
    """
    exu = load()
    explicit = setting.scheme == "Verlet"

    # Set-up, which is timed by itself.
    begin = perf_counter()
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    sensors = _assemble(exu, mbs, chain, root_mass=explicit)
    options = _options(exu, duration, sample, step, setting)
    solver = exu.MainSolverExplicit() if explicit else exu.MainSolverImplicitSecondOrder()
    ready = solver.InitializeSolver(mbs, options)
    setup = perf_counter() - begin

    # The time steps.
    start, processor = perf_counter(), process_time()
    finished = ready and solver.SolveSteps(mbs, options)
    processor, seconds = process_time() - processor, perf_counter() - start

    # Exudyn is finalised even where it stopped short: its next run in this process needs that.
    solver.FinalizeSolver(mbs, options)
    if not finished:
        raise StudyError(f"Exudyn stopped short with {setting.name}, step {step:g} s")
    paths = np.array([mbs.GetSensorStoredData(sensor)[:, 1:3].T for sensor in sensors])
    return Run(paths, solver.it.currentStepIndex - 1, seconds, processor, setup)


def _assemble(exu: Any, mbs: Any, chain: Chain, *, root_mass: bool) -> list[int]:
    """Build the chain along the x axis; return the sensors at the links' ends."""
    from exudyn import itemInterface as items

    start, before = 0.0, mbs.AddNode(items.NodePointGround())
    sensors: list[int] = []
    for link in chain.links:
        # A node holds position and slope, in the straight chain (1, 0) along x.
        length = link.length / chain.elements
        places = [start + i * length for i in range(chain.nodes)]
        nodes = [
            mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[place, 0, 1, 0]))
            for place in places
        ]

        for pair in pairwise(nodes):
            cable = items.ObjectANCFCable2D(
                length=length,
                massPerLength=link.linear_density,
                nodeNumbers=list(pair),
                bendingStiffness=link.bending_stiffness,
                axialStiffness=link.axial_stiffness,
            )
            body = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=mbs.AddObject(cable)))
            gravity = [*chain.gravity, 0.0]
            mbs.AddLoad(items.LoadMassProportional(markerNumber=body, loadVector=gravity))

        if root_mass and not sensors:
            _hold(mbs, items, nodes[0])
        else:
            _hinge(mbs, items, before, nodes[0])
        before, start = nodes[-1], start + link.length

        position = exu.OutputVariableType.Position
        sensor = items.SensorNode(
            nodeNumber=before, storeInternal=True, outputVariableType=position
        )
        sensors.append(mbs.AddSensor(sensor))
    mbs.Assemble()
    return sensors


def _hinge(mbs: Any, items: Any, before: int, after: int) -> None:
    """Tie the positions of two nodes, the first of which may be the ground."""
    for axis in (0, 1):
        markers = [
            mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=axis))
            for node in (before, after)
        ]
        mbs.AddObject(items.CoordinateConstraint(markerNumbers=markers))


def _hold(mbs: Any, items: Any, node: int) -> None:
    """Hold a node by a mass without weight: the explicit solvers take no constraint."""
    nothing = np.zeros((4, 4))
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=np.diag([ROOT_MASS, ROOT_MASS, 0.0, 0.0]),
            stiffnessMatrix=nothing,
            dampingMatrix=nothing,
        )
    )


def _options(exu: Any, duration: float, sample: float, step: float, setting: Setting) -> Any:
    """Settings of a run: one thread, sparse matrices, nothing written to files."""
    options = exu.SimulationSettings()
    trapezoidal, explicit = setting.scheme == "trapezoidal", setting.scheme == "Verlet"

    options.solution.file.write = False
    options.solution.sensors.writePeriod = sample
    options.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    options.parallel.numberOfThreads = 1
    options.show.statistics = options.show.computationTime = False

    time = options.timeIntegration
    time.verboseMode = 0
    time.endTime = duration
    time.numberOfSteps = round(duration / step)
    time.adaptiveStep = time.automaticStepSize = False

    time.newton.useModifiedNewton = True
    time.newton.relativeTolerance = setting.tolerance
    time.newton.absoluteTolerance = 1e-2 * setting.tolerance

    time.generalizedAlpha.spectralRadius = 0.9
    time.generalizedAlpha.useNewmark = time.generalizedAlpha.useIndex2Constraints = trapezoidal
    if explicit:
        time.solverType = exu.DynamicSolverType.VelocityVerlet
    return options
