"""A sweep for people and for continuous integration: Markdown and JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from studies.sweeps.gate import GREW, HEADINGS, MOVED, Comparison
from studies.sweeps.summary import Statistic, Summary, number


def markdown(summary: Summary, compared: Sequence[Comparison] | None = None, pictures: Sequence[str] = ()) -> str:
    """The statistics as tables, observer by observer; with a baseline, what shrank comes first; then `pictures` by file name."""
    lines = [f"# Sweep {summary.sweep}" + ("" if summary.form == "full" else f" ({summary.form})"), ""]
    if compared is not None:
        lines += _verdict(compared)
    for observer in dict.fromkeys(f.observer for f in summary.statistics):
        lines += _observer(summary, observer)
    lines += [f"- {note}" for note in summary.notes]
    lines += [f"\n![{name}]({name})" for name in pictures]
    return "\n".join(lines).rstrip() + "\n"


def _verdict(compared: Sequence[Comparison]) -> list[str]:
    bad = [j for j in compared if not j.good]
    grew, moved = (sum(j.state == state for j in compared) for state in (GREW, MOVED))
    others = f"{grew} statistics got better, {moved} Sobol indices moved beyond their confidence."
    if not bad:
        return [
            f"**Nothing shrank**: {len(compared)} statistics are within their tolerance of the baseline. {others}",
            "",
        ]
    lines = [f"**{len(bad)} of {len(compared)} statistics shrank beyond their tolerance.** {others}", ""]
    lines += ["| " + " | ".join(HEADINGS) + " |", "|---|---|---|---:|---:|---:|---|---|"]
    lines += ["| " + " | ".join(j.cells) + " |" for j in bad]
    return [*lines, ""]


def _observer(summary: Summary, observer: str) -> list[str]:
    own = [f for f in summary.statistics if f.observer == observer]
    counts = ", ".join(f"{f.value:.0f} {f.name}" for f in own if f.kind == "count" and (f.value or f.name == "designs"))
    lines = [f"## {observer}", "", counts, ""]
    values = [f for f in own if f.kind == "value"]
    if values:
        lines += ["| measure | statistic | value | unit | at |", "|---|---|---:|---|---|"]
        lines += [f"| {f.measure} | {f.name} | {number(f.value)} | {f.unit} | {f.where()} |" for f in values]
        lines.append("")
    totals = [f for f in own if f.kind == "index" and f.name.startswith("total")]
    if totals:
        lines += ["| measure | total Sobol indices (95 % confidence), largest first |", "|---|---|"]
        for measure in dict.fromkeys(f.measure for f in totals):
            ranked = sorted((f for f in totals if f.measure == measure), key=lambda f: -f.value)
            cells = (f"{f.name.removeprefix('total index ')} {f.value:.3f} ± {f.confidence or 0.0:.3f}" for f in ranked)
            lines.append(f"| {measure} | {', '.join(cells)} |")
        lines.append("")
    return lines


def junit(sweep: str, summary: Summary, compared: Sequence[Comparison] | None) -> bytes:
    """One test case a statistic; without a baseline the statistics are there and none can fail but those without a number."""
    root = ElementTree.Element("testsuites")
    suite = ElementTree.SubElement(root, "testsuite", name=f"gainsmith sweep {sweep}")
    failures = 0
    verdicts: list[tuple[Statistic, Comparison | None]] = [(j.before, j) for j in compared or ()]
    for statistic, verdict in verdicts or [(f, None) for f in summary.statistics]:
        name = f"{statistic.measure}: {statistic.name}" if statistic.measure else statistic.name
        case = ElementTree.SubElement(suite, "testcase", classname=f"{sweep}.{statistic.observer}", name=name)
        message = _complaint(statistic, verdict)
        if message:
            failures += 1
            ElementTree.SubElement(case, "failure", message=message).text = message
    suite.set("tests", str(len(suite)))
    suite.set("failures", str(failures))
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def _complaint(statistic: Statistic, verdict: Comparison | None) -> str:
    """Why a statistic fails; nothing if it does not."""
    if verdict is not None:
        return "" if verdict.good else verdict.line
    without = statistic.name == "designs without a number" and statistic.value > 0.0
    return f"{int(statistic.value)} designs have a measure that is not a number" if without else ""
