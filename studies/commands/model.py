"""Output of `gainsmith model`: signals, numbers, formulas, poles, observability and controllability of a model file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from studies.commands.model_figure import model_figure
from studies.commands.model_overview import Overview, overview
from studies.commands.terminal import print_table
from studies.execution.files import ready_folder
from studies.plots.save import write_figures
from studies.spec import any_model
from synthesis.design.export import formula
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter
from synthesis.models.table import table_words


def run_model(file: str, out: Path | None, as_json: bool) -> int:
    """Print the model and, with `out`, draw it. Raises GainsmithError with file, line and column for a file that is no model."""
    found = overview(any_model(file))
    drawn = []
    if out is not None:
        ready_folder(out)
        drawn = write_figures([model_figure(found)], out)
    if as_json:
        print(json.dumps(found.plain(), indent=1))
        return 0
    print("\n".join(_lines(found.model)))
    headings = [f"{p.name} [{p.unit}]" for p in found.model.parameters]
    headings += [f"pole {i + 1} [1/s]" for i in range(len(found.model.states))]
    rows = [
        [*(f"{value:.4g}" for value in point), *(_complex(s) for s in poles)]
        for point, poles in zip(found.points, found.poles, strict=True)
    ]
    print_table("Poles, the parameters standing still", headings, rows, left=(), width=160)
    print(found.observability.words("observability", "detectable"))
    if found.model.inputs:
        print(found.controllability.words("controllability", "stabilisable"))
    print(_stability(found))
    for path in drawn:
        print(path)
    return 0


def _lines(model: LpvModel) -> Iterator[str]:
    yield f"{model.name}: {model.source}"
    for kind in ("states", "inputs", "outputs", "disturbances"):
        signals = getattr(model, kind)
        if signals:
            yield f"{kind:<14}" + ", ".join(f"{s.name} [{s.unit}]" for s in signals)
    for parameter in model.parameters:
        yield f"{'parameter':<14}{_parameter(parameter)}"
    for constraint in model.constraints:
        yield f"{'constraint':<14}{constraint.words}"
    for name, constant in model.constants.items():
        yield f"{'constant':<14}{name} = {constant.value:g} {constant.unit} ({constant.source})"
    for words in table_words(model.tables, model.parameters, len(model.pieces)):
        yield f"{'tables':<14}{words}"
    for key in MATRICES:
        matrix = getattr(model, key)
        for i, row in enumerate(matrix.tolist()):
            for j, entry in enumerate(row):
                if entry != 0:
                    yield f"{f'{key}[{i}][{j}]':<14}{formula(entry, model)}"


def _parameter(p: SchedulingParameter) -> str:
    rate = "it may jump" if p.may_jump else f"rate {p.rate_minimum:g} to {p.rate_maximum:g} ({p.unit})/s"
    return f"{p.name} from {p.minimum:g} to {p.maximum:g} {p.unit}, {rate}" + (", absolute value" if p.absolute else "")


def _complex(s: complex) -> str:
    return f"{s.real:.4g}" + (
        f" {'+' if s.imag > 0 else '-'} {abs(s.imag):.4g}j" if abs(s.imag) > 1e-9 * abs(s) else ""
    )


def _stability(found: Overview) -> str:
    """Of the frozen plant on the line that is drawn and in the table: a remark, no proof."""
    slowest = max(found.line_poles.real.max(), found.poles.real.max())
    fastest = max(abs(found.line_poles).max(), abs(found.poles).max())
    words = "no pole right of" if slowest < 0 else "poles as far right as"
    return f"frozen poles: {words} {slowest:.4g} 1/s, none faster than {fastest:.4g} 1/s, wherever looked at"
