"""The figure, and what the report shows: curves, parameters, and the slider in motion."""

import numpy as np

from studies.common.charts import charts_of_arrays

from .study import SliderStudy

# where the rope is fastened, and the corners of the slider [m]
BLOCK = np.array([(0, 0), (-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])


def charts(result):
    """Curves of all arrays, of both laws."""
    return charts_of_arrays(result)


def parameters(configuration):
    """All keys, with what was stated."""
    from studies.common.parameters import stated_parameters

    return stated_parameters(SliderStudy, configuration)


def draw(result):
    """Force and speed of both laws, and the rope at several instants."""
    from matplotlib.figure import Figure

    from studies.common.drawing import label_axes

    study = SliderStudy(**result.configuration)
    laws = list(result.table[0].values)
    time = result.arrays["time"].values
    figure = Figure(figsize=(7, 7), layout="constrained")
    rail, *panels = figure.subplots(3, 1)
    for s in np.interp(np.linspace(0, study.duration, 9), time, result.arrays["position"].values):
        rail.plot([s, study.pulley_distance], [0, study.pulley_height], color="C0", linewidth=0.8)
        rail.plot([s], [0], "s", color="C0")
    rail.plot([study.pulley_distance], [study.pulley_height], "o", color="0.3", markersize=10)
    rail.axhline(0, color="0.5", zorder=0)
    rail.set_aspect("equal")
    rail.set_xlim(-0.05 * study.pulley_distance, 1.05 * study.pulley_distance)
    rail.set_ylim(-0.1 * study.pulley_height, 1.15 * study.pulley_height)
    label_axes(rail, "along the rail [m]", "height [m]")

    for panel, name in zip(panels, ("force", "speed"), strict=True):
        unit = result.arrays[name].unit
        panel.plot(time, result.arrays[name].values, label=laws[0])
        panel.plot(time, result.arrays[f"polynomial/{name}"].values, label=laws[1])
        label_axes(panel, "time [s]", f"{name} [{unit}]")
    panels[0].axhline(result.bounds["peak-force"], color="0.5", linestyle="--", label="bound")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    yield "motion", figure


def scene(result):
    """The slider and its rope."""
    from studies.common.scene.moving_picture import LawOfMotion, MovingPicture, Strand

    study = SliderStudy(**result.configuration)
    pulley = (study.pulley_distance, study.pulley_height)
    places = np.array([0.0, study.travel])
    shapes = np.zeros((2, 7, 3))  # between these two all points move in proportion
    shapes[:, :5, 0] = places[:, None] + BLOCK[:, 0]
    shapes[:, :5, 1] = BLOCK[:, 1]
    shapes[:, 5, :2] = pulley
    shapes[:, 6, 0] = study.pulley_distance

    series = result.arrays
    laws = tuple(
        LawOfMotion(
            name,
            series["time"].values,
            series[f"{head}position"].values,
            series[f"{head}speed"].values,
            series[f"{head}force"].values,
            series[f"{head}rope_length"].values,
        )
        for name, head in zip(result.table[0].values, ("", "polynomial/"), strict=True)
    )
    return MovingPicture(
        title="slider",
        shapes=shapes,
        parameter=places,
        strands=(
            Strand("slider", np.array([[1, 2], [2, 3], [3, 4], [4, 1]])),
            Strand("rope", np.array([[0, 5]])),
            Strand("post", np.array([[5, 6]])),
        ),
        laws=laws,
        size=study.pulley_distance,
        flat=True,
    )
