"""A sweep for people and for continuous integration: Markdown and JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from studies.sweeps.figures import Figure, Summary, number
from studies.sweeps.gate import GREW, MOVED, Judged, loss_text


def markdown(summary: Summary, judged: Sequence[Judged] | None = None, pictures: Sequence[str] = ()) -> str:
    """The figures as tables, subject by subject; with a baseline, what shrank comes first; then `pictures` by file name."""
    lines = [f"# Sweep {summary.sweep}" + ("" if summary.form == "full" else f" ({summary.form})"), ""]
    if judged is not None:
        lines += _verdict(judged)
    for subject in dict.fromkeys(f.subject for f in summary.figures):
        lines += _subject(summary, subject)
    lines += [f"- {note}" for note in summary.notes]
    lines += [f"\n![{name}]({name})" for name in pictures]
    return "\n".join(lines).rstrip() + "\n"


def _verdict(judged: Sequence[Judged]) -> list[str]:
    bad = [j for j in judged if not j.good]
    grew, moved = (sum(j.state == state for j in judged) for state in (GREW, MOVED))
    others = f"{grew} figures got better, {moved} Sobol indices moved beyond their confidence."
    if not bad:
        return [f"**Nothing shrank**: {len(judged)} figures are within their tolerance of the baseline. {others}", ""]
    lines = [f"**{len(bad)} of {len(judged)} figures shrank beyond their tolerance.** {others}", ""]
    lines += [
        "| subject | measure | figure | from | to | loss | at | what did it |",
        "|---|---|---|---:|---:|---:|---|---|",
    ]
    for j in bad:
        after = "gone" if j.after is None else number(j.after.value)
        lost = loss_text(j.loss) if j.before.kind == "value" else ""
        cells = (j.before.subject, j.before.measure, j.before.name, number(j.before.value), after, lost)
        lines.append("| " + " | ".join((*cells, _at(j.after) if j.after else "", j.cause)) + " |")
    return [*lines, ""]


def _subject(summary: Summary, subject: str) -> list[str]:
    own = [f for f in summary.figures if f.subject == subject]
    counts = ", ".join(
        f"{int(f.value)} {f.name}" for f in own if f.kind == "count" and (f.value or f.name == "designs")
    )
    lines = [f"## {subject}", "", counts, ""]
    values = [f for f in own if f.kind == "value"]
    if values:
        lines += ["| measure | figure | value | unit | at |", "|---|---|---:|---|---|"]
        lines += [f"| {f.measure} | {f.name} | {number(f.value)} | {f.unit} | {_at(f)} |" for f in values]
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


def _at(figure: Figure) -> str:
    return ", ".join(f"{name} = {number(value, 4)}" for name, value in figure.at.items())


def junit(sweep: str, summary: Summary, judged: Sequence[Judged] | None) -> bytes:
    """One test case a figure; without a baseline the figures are there and none can fail but those without a number."""
    root = ElementTree.Element("testsuites")
    suite = ElementTree.SubElement(root, "testsuite", name=f"gainsmith sweep {sweep}")
    failures = 0
    verdicts: list[tuple[Figure, Judged | None]] = [(j.before, j) for j in judged or ()]
    for figure, verdict in verdicts or [(f, None) for f in summary.figures]:
        name = f"{figure.measure}: {figure.name}" if figure.measure else figure.name
        case = ElementTree.SubElement(suite, "testcase", classname=f"{sweep}.{figure.subject}", name=name)
        message = _complaint(figure, verdict)
        if message:
            failures += 1
            ElementTree.SubElement(case, "failure", message=message).text = message
    suite.set("tests", str(len(suite)))
    suite.set("failures", str(failures))
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def _complaint(figure: Figure, verdict: Judged | None) -> str:
    """Why a figure fails; nothing if it does not."""
    if verdict is not None:
        return "" if verdict.good else verdict.line
    without = figure.name == "designs without a number" and figure.value > 0.0
    return f"{int(figure.value)} designs have a measure that is not a number" if without else ""
