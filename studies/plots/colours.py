"""Colours of the figures, by name and by role: an estimator looks the same wherever it is drawn.

Distinct in print and for the colour-blind; every figure also differs by dashes, markers or places.
"""

from __future__ import annotations

BLUE, ORANGE, GREEN, RED, PURPLE, GREY = "#0b62a4", "#e08214", "#1b7f5c", "#c1272d", "#7b3294", "0.45"
CURVES = (BLUE, RED, GREEN, ORANGE, PURPLE, GREY)
"""Curves of models and analyses, in the order in which a figure takes them."""
PRINTED_BAND = "#4477aa"
"""Shade of what a paper prints as a range."""
FORBIDDEN = "#f2c4c4"
"""Shade of where nothing is stable."""
FITTED, LEFT_OUT = "#d1495b", "0.8"
DEPLOYED = "#aa3377"
"""Gains as a schedule has them."""
NOMINAL, WORST, BEST = "0.1", RED, BLUE
"""Designs of a sweep."""
BELOW, ABOVE = BLUE, ORANGE
"""A parameter below and above its nominal value; what won and what lost."""
DIVERGING = "RdBu_r"
"""A map of colours, for values to either side of a middle."""
ALONG = "cividis"
LOWER_END, MIDDLE, UPPER_END = "#00224e", "#7d7c78", "#fee838"
"""A map of colours from dark to light, and what stands at its ends and in its middle: its order survives a grey print."""

TEAL, RUST, MINT, PLUM, SAND = "#1f6f8b", "#c2571a", "#3a9e6f", "#7a3b8f", "#c9a227"
TRUTH = "black"
FUSION = UNSCENTED = TEAL
OWN_OBSERVERS = KALMAN = EXTENDED = RUST
"""Of the paper at hand: its corner observers, its first filter."""
PIPELINE = MINT
SCHEDULE = PLUM
SECOND_FILTER = "#d9a441"
MEAN_WHEEL_SPEED = STEADY = "#ababab"
INTEGRATED_ACCELERATION = "#707070"
LIMIT = "#c23b3b"
HIGH_SLIP = "#f3d9c8"
"""Shade of where a detector speaks."""
CORNERS = (TEAL, RUST, MINT, PLUM)
"""fl, fr, rl, rr."""
SETTINGS = (RUST, TEAL, MINT)
"""Three settings of one estimator."""
ROADS = (TEAL, MINT, SAND, RUST, PLUM)
"""Cases of one experiment, such as frictions of the road."""
