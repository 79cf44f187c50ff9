"""The scoreboard as a picture: one square for each claim, a row for each paper, a legend with counts."""

from __future__ import annotations

from studies.claim import ClaimVerdict
from studies.report.html.page import environment
from studies.report.scoreboard import Scoreboard

WIDTH, LEFT, RIGHT, PITCH, SQUARE = 880, 190, 56, 22, 18  # px
TOP, ROW, LEGEND = 70, 42, 26  # px; a row of a paper with one line of squares is ROW high
ACROSS = (WIDTH - LEFT - RIGHT) // PITCH


def scoreboard_svg(board: Scoreboard) -> str:
    """The picture as SVG text, readable in light and dark; without claims it says so."""
    rows, y = [], TOP
    for paper in board.papers:
        squares = [
            {"x": LEFT + PITCH * (i % ACROSS), "y": y + PITCH * (i // ACROSS), "claim": claim, "side": SQUARE}
            for i, claim in enumerate(paper.claims)
        ]
        rows.append({"paper": paper, "y": y, "squares": squares})
        y += ROW + PITCH * ((len(paper.claims) - 1) // ACROSS)
    columns = [WIDTH * (0.03 + 0.31 * (i % 3)) for i in range(len(ClaimVerdict))]
    legend = [
        {"verdict": verdict, "x": round(columns[i]), "y": y + 14 + LEGEND * (i // 3), "count": board.count(verdict)}
        for i, verdict in enumerate(ClaimVerdict)
    ]
    return environment().get_template("scoreboard.svg.jinja").render(
        board=board, rows=rows, legend=legend, width=WIDTH, height=y + 14 + 2 * LEGEND + 12, side=SQUARE
    )  # fmt: skip
