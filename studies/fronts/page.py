"""What a report shows of a front: what is least over what is limited, and the price."""

from __future__ import annotations

from studies.common.charts import Chart, ChartAxis, Curve
from studies.common.result import Result
from studies.fronts.columns import FrontAxis

FRONT = "front"


def charts(result: Result) -> tuple[Chart, ...]:
    """The front with the paper's laws, and the price of the limit."""
    x, y = (FrontAxis(**axis) for axis in result.details["axes"])
    values = {name: series.values for name, series in result.arrays.items()}
    along = ChartAxis(x.key, x.title, x.unit)

    def curve(name: str, head: str, of: str) -> Curve:
        return Curve(name, {x.key: values[f"{head}{x.key}"]}, values[of])

    tail = f" {x.key}"
    laws = [name.removesuffix(tail) for name in values if name.endswith(tail)]
    beside = [curve(law, f"{law} ", f"{law} {y.key}") for law in laws if law != "dominated"]
    found = curve(FRONT, "", y.key)
    price = result.arrays["price"]
    title = f"shadow price of the limit on {x.title}"
    return (
        Chart(FRONT, y.title, y.unit, (along,), (found, *beside), path=True),
        Chart(
            "price",
            title,
            price.unit,
            (along,),
            (curve(FRONT, "", "price"),),
            meaning=price.meaning,
        ),
    )


def scene(result: Result) -> None:
    """Nothing moves: a front has as many motions as points."""
    del result
