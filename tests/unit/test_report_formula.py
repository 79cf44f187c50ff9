"""Formulas in plain text: found where they stand, set as MathML, never a word, a unit or a label of an equation."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from studies.report.formula import formulas, whole_formula
from studies.report.mathml import symbol, typeset


def found(text: str) -> list[str]:
    return [text[start:end] for start, end, _ in formulas(text)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("With A_e'P + P A_e < -t it decays", ["A_e'P + P A_e < -t"]),
        ("as Q: A_e Q + Q A_e' - dQ/dt < 0 over", ["A_e Q + Q A_e' - dQ/dt < 0"]),
        ("for |omega| <= 180 rad/s and |d omega/dt| <= 800 rad/s^2", ["|omega| <= 180", "|d omega/dt| <= 800"]),
        ("gain -sigma0/(sigma0 + sigma2 kappa R_e |omega|) for", ["-sigma0/(sigma0 + sigma2 kappa R_e |omega|)"]),
        ("decays with V = e'Pe there", ["V = e'Pe"]),
        ("P = diag(110,000, 1) proves", ["P = diag(110,000, 1)"]),
        ("by (A4) and (28), (40) of P1 (longitudinal)", []),
        ("A penalty of 100 N/s over 0.3 m at 40 rad/s, a well-posed H-infinity design of 2 kN m", []),
        ("Sigma point weights W_i = 1/(2 (N + eta))", ["W_i = 1/(2 (N + eta))"]),
        ("L = 7/48 m = 0.1458 m", ["L = 7/48"]),
        ("With the T of Proposition 1 lambda_bar is", ["lambda_bar"]),
        ("Margin 1 - rho of stability", ["1 - rho"]),
        ("the 3 x 3 square, which no diagonal T can do better", []),
        ("already set: σ₀/(σ₀ + σ₂κRₑ|ω|) and μF_z", []),
        ("off by (force_rl - front_force_x)*sin(steering_angle)/mass.", ["(force_rl - front_force_x)*sin(steering_angle)/mass"]),
    ],
)  # fmt: skip
def test_formulas_are_found_and_words_are_not(text: str, expected: list[str]) -> None:
    assert found(text) == expected


def test_text_around_formulas_stays_and_everything_is_escaped() -> None:
    text = 'a <b> & "c": lambda_bar < 0, then 2 < 3.'
    page = typeset(text)
    assert (
        re.sub(r"<math alttext=\"(.*?)\">.*?</math>", r"\1", page)
        == "a &lt;b&gt; &amp; &quot;c&quot;: lambda_bar &lt; 0, then 2 &lt; 3."
    )
    (math,) = re.findall(r"<math.*</math>", page)
    root = ElementTree.fromstring(math)
    assert root.attrib["alttext"] == "lambda_bar < 0" and "".join(root.itertext()) == "λ¯<0"


@pytest.mark.parametrize(
    ("text", "tags", "shown"),
    [
        ("sqrt(c/b_1)", ["msqrt", "mfrac"], "cb1"), ("M^-1 B_2", ["msup"], "M−1B2"), ("x_1^2", ["msup", "msub"], "x12"),
        ("2.5e-3 A_0", ["msup"], "2.5×10-3A0"), ("mass**2*yaw_inertia", ["msup"], "mass2yaw inertia"),
    ],
)  # fmt: skip
def test_powers_fractions_and_roots(text: str, tags: list[str], shown: str) -> None:
    assert whole_formula(text) is not None
    root = ElementTree.fromstring(typeset(text))
    assert all(root.iter(tag) and next(root.iter(tag), None) is not None for tag in tags)
    assert "".join(root.itertext()) == shown


def test_what_is_half_a_formula_is_no_whole_one() -> None:
    assert whole_formula("sigma0 + and") is None and whole_formula("(sigma0") is None and whole_formula("") is None


@pytest.mark.parametrize(
    "name", ["sigma0", "A_e", "lambda_bar", "dOmega_f", "effective_radius", "L1x", "phi_(k+1,0)", "dQ"]
)
def test_symbols_are_well_formed(name: str) -> None:
    ElementTree.fromstring(symbol(name))


def test_accelerations_have_a_raised_two() -> None:
    assert typeset("0.5 m/s^2 and radius^2") == "0.5 m/s² and radius^2"


def test_deep_nesting_ends() -> None:
    assert found("(" * 300 + "sigma0" + ")" * 300) in (["sigma0"], ["(" * 299 + "sigma0" + ")" * 299], [])
