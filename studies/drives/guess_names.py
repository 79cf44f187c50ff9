"""What a column is, from how people call it in English and German, and its unit from the brackets behind the name."""

from __future__ import annotations

import re
import unicodedata
from typing import NamedTuple

from studies.drives.quantities import CORNERS, REFERENCES, SIGNALS, factor_to

_CORNERS = {
    "fl": "fl", "fr": "fr", "rl": "rl", "rr": "rr", "vl": "fl", "vr": "fr", "hl": "rl", "hr": "rr", "lf": "fl", "rf": "fr",
    "lr": "rl", "frontleft": "fl", "frontright": "fr", "rearleft": "rl", "rearright": "rr",
}  # fmt: skip
"""Front left and so on; German vorne/hinten links/rechts; left front as in America."""
_ENDS = {"front": "f", "vorne": "f", "vorn": "f", "avant": "f", "rear": "r", "hinten": "r", "arriere": "r"}
_SIDES = {"left": "l", "links": "l", "gauche": "l", "right": "r", "rechts": "r", "droite": "r", "droit": "r"}
_FRENCH = {"avg": "fl", "avd": "fr", "arg": "rl", "ard": "rr"}  # where the name is French: avg is an average elsewhere
_AT_CORNER = {
    "wheel_speed": r"(omega|w|ws|n|whl|rad|raddrehzahl|drehzahl|radgeschwindigkeit|raddrehgeschwindigkeit|v rad|n rad|"
    r"omega rad|v wheel|"
    r"vitesse (de )?(la )?roue|regime roue|(whl|wheel) ?(ang(ular)?|rot(ational)?)? ?(speed|spd|vel|velocity|rpm|"
    r"omega)?|wheelspeed|(speed|spd|velocity) wheel|v)",
    "torque": r"(t|m|torque|trq|(wheel|whl) ?(torque|trq)|couple( (de |a la )?roue)?|moment|radmoment|drehmoment|"
    r"antriebsmoment)",
    "steer": r"(d|delta|steer|steering|steer(ing)? ?(angle|ang)|road wheel angle|angle (de )?braquage( roue)?|"
    r"lenkwinkel|radlenkwinkel)",
}  # fmt: skip
_ACCELERATION = r"(a|g|acc|accel|acceleration|linear acceleration|beschleunigung)"
_RATE = r"(rate|velocity|speed|angular rate|angular velocity)"
_OF_CAR = {
    "time": r"(t|time|zeit|temps|horodatage|time ?stamps?|car time|zeitstempel|uhrzeit|time rel|rel time|epoch|sec|seconds)",
    "yaw_rate": rf"(r|yaw ?{_RATE}|gier ?rate|gier(winkel)?geschwindigkeit|vitesse (de |en )?lacet|psi ?(dot|p)|"
    rf"(omega|gyro|w|angular velocity|rate) ?z)",
    "roll_rate": rf"(roll ?{_RATE}|(wank|roll) ?rate|(wank|roll)(winkel)?geschwindigkeit|vitesse (de |en )?roulis|"
    rf"phi ?(dot|p)|(omega|gyro|w|angular velocity|rate) ?x)",
    "pitch_rate": rf"(pitch ?{_RATE}|nick ?rate|nick(winkel)?geschwindigkeit|vitesse (de |en )?tangage|theta ?(dot|p)|"
    rf"(omega|gyro|w|angular velocity|rate) ?y)",
    "ax": rf"({_ACCELERATION} ?(x|long(itudinale?)?|laengs)|ax|long(itudinal)? ?(acc|accel|acceleration)|"
    rf"laengsbeschleunigung|along)",
    "ay": rf"({_ACCELERATION} ?(y|lat(erale?)?|transversale|quer)|ay|lat(eral)? ?(acc|accel|acceleration)|"
    rf"querbeschleunigung|alat)",
    "az": rf"({_ACCELERATION} ?(z|verticale?|vertikal|hoch)|az|vert(ical)? ?(acc|accel|acceleration)|"
    rf"vertikalbeschleunigung|hochbeschleunigung)",
    "hand_wheel": r"(hand ?wheel( angle)?|steering ?wheel ?(angle|ang)?|swa|lenkrad ?winkel|angle (du |de )?volant|lws|lrw)",
    "steering": r"(steer(ing)?( angle)?|delta( f)?|road wheel angle|front steer(ing)?( angle)?|(rad)?lenkwinkel)",
}  # fmt: skip
_REFERENCE = {
    "vx": r"(vx|v ?x|(twist )+linear x|velocity ?x|geschwindigkeit laengs|vitesse (longitudinale|vehicule)|"
    r"(veh|vehicle|car) ?(spd|vel)|"
    r"long(itudinal)? ?(velocity|vel|speed)|laengsgeschwindigkeit|v ?ref|v|"
    r"(gps|gnss|ins|reference) ?(speed|velocity)|(vehicle )?speed|velocity|geschwindigkeit|fahrzeuggeschwindigkeit|"
    r"v ?long)",
    "vy": r"(vy|v ?y|(twist )+linear y|velocity ?y|geschwindigkeit quer|vitesse (laterale|transversale)|"
    r"lat(eral)? ?(velocity|vel|speed)|quergeschwindigkeit|v ?lat)",
}  # fmt: skip
_BESIDE = {"ref", "reference", "true", "truth", "gps", "gnss", "ins", "optical"}  # what measures a reference
_NOISE = {
    "esp", "esc", "abs", "dsc", "lwi", "ecu", "data", "values", "raw", "filtered", "filt", "corrected", "corr", "meas",
    "measured", "sensor", "signal", "value", "imu", "can", "act", "ist",
}  # fmt: skip
"""Words that say nothing of what a column is."""
_WHOLE = {"beschl": "beschleunigung", "geschw": "geschwindigkeit"}
_ABBREVIATED = re.compile("(beschl|geschw)$")
_UNITS = {
    "°": "deg", "grad": "deg", "degree": "deg", "degrees": "deg", "°/s": "deg/s",
    "deg/sec": "deg/s", "degps": "deg/s", "dps": "deg/s",
    "radps": "rad/s", "rad/sec": "rad/s", "1/min": "rpm", "u/min": "rpm", "min^-1": "rpm", "tr/min": "rpm",
    "rev/min": "rpm", "kmh": "km/h",
    "kph": "km/h", "kmph": "km/h", "mps": "m/s", "m/sec": "m/s", "mps2": "m/s^2", "m/s2": "m/s^2", "m/s²": "m/s^2",
    "m/s/s": "m/s^2",
    "m/s**2": "m/s^2", "ms-2": "m/s^2", "nm": "N*m", "n m": "N*m", "sec": "s", "seconds": "s", "sekunden": "s", "msec": "ms",
    "µs": "us", "usec": "us", "g": "g",
}  # fmt: skip
_SAID = re.compile(r"(.+?)(?: in |\s*/\s*)([^/].*)")  # wheel speed in rad/s, v/(m/s)
_GROUP = re.compile(r"@\d+$")  # of an MDF file
_ELEMENT = re.compile(r"(.+)\[(\d+)\]")
_BRACKETS = re.compile(r"\s*[\[(<{]\s*([^\])>}]*)\s*[\])>}]\s*$")


_KNOWN = {*_UNITS, *_UNITS.values(), "s", "ms", "us", "ns", "rpm", "deg", "rad"} - {"g", "grad"}


class Guess(NamedTuple):
    """Table (``time``, ``signals`` or ``reference``), name there, and the unit that the name says, if it does."""

    table: str
    name: str
    unit: str | None


def guess_column(column: str, unit: str = "") -> Guess | None:
    """What a column of this name is; ``unit`` as a row of units has it. None where no rule knows it.

    A field of a struct or of a message, a.b.c, is what its whole name says, or else b.c, or else c. Of an array of wheel speeds
    the elements are taken in the order front left, front right, rear left, rear right.
    """
    column = _GROUP.sub("", column)
    while column:
        found = _guess(column, unit) or _of_array(column, unit)
        if found is not None or ("[" in column and not _ELEMENT.fullmatch(column)):
            return found
        column = column.partition(".")[2]
    return None


def _of_array(column: str, unit: str) -> Guess | None:
    element = _ELEMENT.fullmatch(column)
    if element is None or int(element[2]) >= len(CORNERS):
        return None
    found = _guess(f"{element[1]} {CORNERS[int(element[2])]}", unit)
    return found if found is not None and found.name.startswith("wheel_speed_") else None


def _guess(column: str, unit: str) -> Guess | None:
    if column.startswith("/"):  # of a bag: the field says what it is, or the topic where the field is just "data"
        topic, _, rest = column.partition(".")
        column = topic.rpartition("/")[2] if rest in ("", "data", "value") else rest
    brackets = _BRACKETS.search(column)
    said = unit or (brackets[1] if brackets else "")
    name = column[: brackets.start()].rstrip(" /") if brackets else column
    behind = _SAID.fullmatch(name)
    if not said and behind and behind[2].strip(" ()[]").lower() in _KNOWN:
        name, said = behind[1], behind[2]
    words = _words(name)
    if not said and len(words) > 1 and words[-1] in _KNOWN:
        said = words.pop()
    return _of_words(words, said) or _of_words([word for word in words if word not in _NOISE], said)


def _of_words(words: list[str], said: str) -> Guess | None:
    corners = _CORNERS | _FRENCH if {"roue", "couple", "braquage"} & set(words) else _CORNERS
    corner = next((c for word in words if (c := corners.get(word)) is not None), None)
    if corner is not None:
        rest = " ".join(word for word in words if word not in corners)
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
    name = "".join(letter for letter in unicodedata.normalize("NFKD", name) if not unicodedata.combining(letter))
    words = re.sub(r"[^A-Za-z0-9]+", " ", name).lower().split()
    words = [_ABBREVIATED.sub(lambda cut: _WHOLE[cut[0]], word) for word in words]
    joined: list[str] = []
    for word in words:
        last = joined[-1] if joined else ""
        if last in _ENDS and word in _SIDES:
            joined[-1] = _ENDS[last] + _SIDES[word]
        elif last in _SIDES and word in _ENDS:
            joined[-1] = _ENDS[word] + _SIDES[last]
        else:
            joined.append(word)
    return joined


def _unit(said: str, target: str) -> str | None:
    """The unit in this project's spelling, if it measures ``target``; a surface speed also measures a wheel's."""
    bare = said.strip().strip("[](){}<>").strip()
    unit = _UNITS.get(bare.lower(), bare)
    for wanted in (target, "m/s") if target == "rad/s" else (target,):
        try:
            factor_to(unit, wanted)
        except ValueError:
            continue
        return unit
    return None
