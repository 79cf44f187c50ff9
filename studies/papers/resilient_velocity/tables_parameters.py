"""Table I, with the units that its equations need."""

from __future__ import annotations

from studies.papers.resilient_velocity.setting import DIRECTIONS, PRINTED, Setting
from studies.study import Cell, Table
from synthesis.models.parameter_set import quantities

MISPRINTED = {"kappa": "s/m"}


def table_1(setting: Setting = PRINTED) -> Table:
    """Tire constants, vehicle and gains."""
    rows: list[tuple[Cell, ...]] = []
    for direction in DIRECTIONS:
        for name, quantity in quantities(setting.parameters.tire[direction]).items():
            rows.append((f"{name}, {direction}", quantity.value, quantity.unit, MISPRINTED.get(name, quantity.unit)))
    for name, quantity in setting.parameters.vehicle.items():
        rows.append((name.replace("_", " "), quantity.value, quantity.unit, quantity.unit))
    for direction in DIRECTIONS:
        for index, unit in enumerate(("m/s", "m/s^2")):
            rows.append((f"gain L{index + 1}, {direction}", setting.gains[direction][index], unit, "not printed"))
    for index, unit in enumerate(("m/s", "m/s^2")):
        rows.append((f"gain L{index + 1}, longitudinal, high slip", setting.high_slip[index], unit, "not printed"))
    return Table(
        "table-1",
        "Table I of P3 with the gains of the road tests, as every result of this study uses them. The unit of "
        "kappa is corrected: with s/m the bristle equation (1) would add unlike quantities.",
        ("quantity", "value", "unit used", "unit printed"),
        rows,
    )
