"""What a column is, from how people call it in English and German, and its unit from the brackets behind the name."""

from __future__ import annotations

import re
from typing import NamedTuple

from studies.drives.quantities import REFERENCES, SIGNALS, factor_to

_CORNERS = {
    "fl": "fl", "fr": "fr", "rl": "rl", "rr": "rr", "vl": "fl", "vr": "fr", "hl": "rl", "hr": "rr", "lf": "fl", "rf": "fr",
    "lr": "rl", "frontleft": "fl", "frontright": "fr", "rearleft": "rl", "rearright": "rr",
}  # fmt: skip
"""Front left and so on; German vorne/hinten links/rechts; left front as in America."""
_AT_CORNER = {
    "wheel_speed": r"(omega|w|ws|n|whl|rad|raddrehzahl|drehzahl|radgeschwindigkeit|raddrehgeschwindigkeit|v rad|n rad|"
    r"omega rad|v wheel|"
    r"(whl|wheel) ?(ang(ular)?|rot(ational)?)? ?(speed|spd|vel|velocity|rpm|omega)?|wheelspeed|(speed|spd|velocity) wheel|v)",
    "torque": r"(t|m|torque|trq|wheel torque|moment|radmoment|drehmoment|antriebsmoment)",
    "steer": r"(delta|steer|steering|steer(ing)? angle|road wheel angle|lenkwinkel|radlenkwinkel)",
}  # fmt: skip
_ACCELERATION = r"(a|acc|accel|acceleration|linear acceleration|beschleunigung|imu acc|imu a)"
_RATE = r"(rate|velocity|speed|angular rate|angular velocity)"
_OF_CAR = {
    "time": r"(t|time|zeit|time ?stamps?|car time|zeitstempel|uhrzeit|time rel|rel time|epoch|sec|seconds)",
    "yaw_rate": rf"(r|yaw ?{_RATE}|gier ?rate|gier(winkel)?geschwindigkeit|psi ?(dot|p)|(omega|gyro|w|angular velocity|rate) ?z)",
    "roll_rate": rf"(roll ?{_RATE}|wank ?rate|phi ?(dot|p)|(omega|gyro|w|angular velocity|rate) ?x)",
    "pitch_rate": rf"(pitch ?{_RATE}|nick ?rate|theta ?(dot|p)|(omega|gyro|w|angular velocity|rate) ?y)",
    "ax": rf"({_ACCELERATION} ?(x|long)|ax|long(itudinal)? ?(acc|accel|acceleration)|laengsbeschleunigung|along)",
    "ay": rf"({_ACCELERATION} ?(y|lat)|ay|lat(eral)? ?(acc|accel|acceleration)|querbeschleunigung|alat)",
    "az": rf"({_ACCELERATION} ?z|az|vert(ical)? ?(acc|accel|acceleration)|vertikalbeschleunigung|hochbeschleunigung)",
    "hand_wheel": r"(hand ?wheel( angle)?|steering ?wheel ?(angle|ang)?|swa|lenkrad ?winkel|lws)",
    "steering": r"(steer(ing)?( angle)?|delta( f)?|road wheel angle|front steer(ing)?( angle)?|(rad)?lenkwinkel)",
}  # fmt: skip
_REFERENCE = {
    "vx": r"(vx|v ?x|velocity ?x|long(itudinal)? ?(velocity|vel|speed)|laengsgeschwindigkeit|v ?ref|v|"
    r"(gps|gnss|ins|reference) ?(speed|velocity)|(vehicle )?speed|velocity|geschwindigkeit|fahrzeuggeschwindigkeit|v ?long)",
    "vy": r"(vy|v ?y|velocity ?y|lat(eral)? ?(velocity|vel|speed)|quergeschwindigkeit|v ?lat)",
}  # fmt: skip
_BESIDE = {"ref", "reference", "true", "truth", "gps", "gnss", "ins", "optical"}  # what measures a reference
_UNITS = {
    "°": "deg", "grad": "deg", "degree": "deg", "degrees": "deg", "°/s": "deg/s",
    "deg/sec": "deg/s", "degps": "deg/s", "dps": "deg/s",
    "radps": "rad/s", "rad/sec": "rad/s", "1/min": "rpm", "u/min": "rpm", "min^-1": "rpm", "rev/min": "rpm", "kmh": "km/h",
    "kph": "km/h", "kmph": "km/h", "mps": "m/s", "m/sec": "m/s", "mps2": "m/s^2", "m/s2": "m/s^2", "m/s²": "m/s^2",
    "m/s/s": "m/s^2",
    "m/s**2": "m/s^2", "ms-2": "m/s^2", "nm": "N*m", "n m": "N*m", "sec": "s", "seconds": "s", "sekunden": "s", "msec": "ms",
    "µs": "us", "usec": "us", "g": "g",
}  # fmt: skip
_BRACKETS = re.compile(r"\s*[\[(<{]\s*([^\])>}]*)\s*[\])>}]\s*$")


class Guess(NamedTuple):
    """Table (``time``, ``signals`` or ``reference``), name there, and the unit that the name says, if it does."""

    table: str
    name: str
    unit: str | None


def guess_column(column: str, unit: str = "") -> Guess | None:
    """What a column of this name is; ``unit`` as a row of units has it. None where no rule knows it.

    A field of a struct or of a message, a.b.c, is what its whole name says, or else its last part.
    """
    found = _guess(column, unit)
    if found is None and "." in column and "[" not in column:
        return _guess(column.rpartition(".")[2], unit)
    return found


def _guess(column: str, unit: str) -> Guess | None:
    if column.startswith("/"):  # of a bag: the field says what it is, or the topic where the field is just "data"
        topic, _, rest = column.partition(".")
        column = topic.rpartition("/")[2] if rest in ("", "data", "value") else rest
    brackets = _BRACKETS.search(column)
    said = unit or (brackets[1] if brackets else "")
    words = _words(column[: brackets.start()] if brackets else column)
    if (
        not said
        and len(words) > 1
        and (words[-1] in _UNITS or words[-1] in ("s", "ms", "us", "ns", "rpm", "deg", "rad"))
    ):
        said = words.pop()
    corner = next((c for word in words if (c := _CORNERS.get(word)) is not None), None)
    if corner is not None:
        rest = " ".join(word for word in words if word not in _CORNERS)
        for name, pattern in _AT_CORNER.items():
            if re.fullmatch(pattern, rest):
                return Guess("signals", f"{name}_{corner}", _unit(said, SIGNALS[f"{name}_{corner}"]))
        return None
    text = " ".join(words)
    for name, pattern in _OF_CAR.items():
        if re.fullmatch(pattern, text):
            return (
                Guess("time", name, _unit(said, "s"))
                if name == "time"
                else Guess("signals", name, _unit(said, SIGNALS[name]))
            )
    bare = " ".join(word for word in words if word not in _BESIDE)
    for name, pattern in _REFERENCE.items():
        if re.fullmatch(pattern, text) or re.fullmatch(pattern, bare):
            return Guess("reference", name, _unit(said, REFERENCES[name]))
    return None


def _words(name: str) -> list[str]:
    """Lower-case words: wheelSpeed_FL and "Wheel Speed, FL" are the same."""
    name = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name.strip())
    for umlaut, plain in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("Ä", "ae"), ("ß", "ss")):
        name = name.replace(umlaut, plain)
    words = re.sub(r"[^A-Za-z0-9]+", " ", name).lower().split()
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] + word in _CORNERS and joined[-1] in ("front", "rear"):
            joined[-1] += word
        else:
            joined.append(word)
    return joined


def _unit(said: str, target: str) -> str | None:
    """The unit in this project's spelling, if it measures ``target``; a surface speed also measures a wheel's."""
    text = said.strip().lower()
    unit = _UNITS.get(text, said.strip())
    for wanted in (target, "m/s") if target == "rad/s" else (target,):
        try:
            factor_to(unit, wanted)
        except ValueError:
            continue
        return unit
    return None
