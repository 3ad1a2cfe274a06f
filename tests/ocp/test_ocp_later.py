"""Fields that are worked out when they are first read."""

from dataclasses import dataclass, replace

from ocp.later import later, lazy_fields, read_later


@lazy_fields("total")
@dataclass(frozen=True)
class Bill:
    items: tuple[int, ...]
    total: int


def test_a_field_is_worked_out_once_when_it_is_first_read() -> None:
    asked = []
    bill = Bill((1, 2), later(lambda: asked.append(1) or 3))
    doubled = read_later(bill, "total", lambda total: 2 * total)
    copies = Bill((), doubled), Bill((1, 2), 3)
    assert not asked
    assert copies[0].total == 6
    assert bill.total == bill.total == 3
    assert asked == [1]
    assert bill == copies[1] == replace(bill)
    assert read_later(bill, "total", lambda total: 2 * total) == 6
