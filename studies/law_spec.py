"""Keys of a specification that belong to an observer or to a feedback law, and the design of the latter."""

from __future__ import annotations

from typing import Any

from studies.spec_tables import DeploySpec, DesignSpec
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.law_table import FeedbackLaw
from synthesis.design.output_feedback import OutputFeedbackDesign, design_output_feedback
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.sampled_state_feedback import design_sampled_state_feedback
from synthesis.design.state_feedback import GainLimits, StateFeedbackDesign, design_state_feedback
from synthesis.design.static_feedback import design_static_feedback
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.design.weighted_state_feedback import design_weighted_state_feedback
from synthesis.errors import ProblemError
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.feedback import Measured
from synthesis.models.lpv import LpvModel

SAMPLED = "sampled state feedback"
KEYS_OF = {  # of [design], beside those that observers have
    "state feedback": ("damping", "input_limits", "state_sizes"),
    "sampled state feedback": ("damping", "input_limits", "state_sizes"),
    "output feedback": ("feedthrough", "measured"),
    "static output feedback": ("start", "uses"),
}
OF_LAWS = tuple(dict.fromkeys(key for keys in KEYS_OF.values() for key in keys))
FeedbackDesign = StateFeedbackDesign | OutputFeedbackDesign | StaticFeedbackDesign
OF_CHANNELS = ("errors", "performance", "sizes", "norm")  # one of the first two is there


def check_keys(design: DesignSpec, deploy: DeploySpec) -> None:
    """Raise ValueError for a key that the law has no use for, or that it lacks."""
    feedback = design.law is not None
    who = f"the law '{design.law}'" if feedback else "an observer"
    for index, channel in enumerate(design.channels):
        place = f"design.channels[{index}]"
        wanted, other = ("performance", "errors") if feedback else ("errors", "performance")
        if getattr(channel, other) is not None:
            raise ValueError(f"{place}: {other} is not for {who}; give {wanted}")
        if getattr(channel, wanted) is None:
            raise ValueError(f"{place}: {wanted} is missing; {who} needs it")
        if channel.sizes is not None and not feedback:
            raise ValueError(f"{place}: sizes are not for an observer; remove them")
    if feedback and "update" in deploy.model_fields_set:
        raise ValueError(f"deploy.update is not for {who}, which runs once a sample; remove it")
    if feedback and (design.input_limits is None) != (design.state_sizes is None):
        raise ValueError("design: input_limits and state_sizes belong together; a limit holds for states of a size")
    known = () if design.law is None else KEYS_OF[design.law]
    given = next((key for key in OF_LAWS if key not in known and getattr(design, key) is not None), None)
    if given is not None:
        other = next(law for law, keys in KEYS_OF.items() if given in keys)
        raise ValueError(f'design.{given} is not for {who}; remove it, or name another law: law = "{other}"')
    if design.regions is not None:
        _check_regions(design, deploy, who)
    if design.dynamic_weights is not None:
        _check_weights(design)
    if not feedback and deploy.limits is not None:
        raise ValueError("deploy.limits are not for an observer, which commands nothing; remove them")


def _check_regions(design: DesignSpec, deploy: DeploySpec, who: str) -> None:
    """Their law has them, in its time."""
    if design.law == "static output feedback":
        raise ValueError(f"design.regions are not for {who}; remove them, or give a decay rate")
    discrete = design.law == SAMPLED or (design.law is None and deploy.update == "sampled")
    try:
        regions_of(design).refuse_for("discrete" if discrete else "continuous")
    except ProblemError as error:
        raise ValueError(f"design.{error}") from None


def _check_weights(design: DesignSpec) -> None:
    """What weighs signals is computed, not measured: the law must say what it measures."""
    key = {"output feedback": "measured", "static output feedback": "uses"}.get(design.law or "")
    if key is not None and getattr(design, key) is None:
        raise ValueError(f"design.{key} is missing: beside dynamic_weights name the outputs that the law measures")
    shown = [f"{weight.signal}_weighted" for weight in design.dynamic_weights or ()]
    measured = [*(design.measured or ()), *(pair[1] for pair in design.uses or ())]
    stray = next((name for name in measured if name in shown), None)
    if stray is not None:
        raise ValueError(f"design.{key}: '{stray}' comes from a weight and is not measured; remove it")


def feedback_design(spec: DesignSpec) -> FeedbackDesign:
    """As the synthesis takes it."""
    channels = tuple(
        FeedbackChannel(
            tuple(c.disturbances),
            tuple(c.performance or ()),
            c.bound,
            _numbers(c.weights),
            _numbers(c.sizes),
            c.norm or "H-infinity",
        )
        for c in spec.channels
    )
    settings = LmiSettings(relaxation=spec.relaxation, points=spec.points, solver=spec.solver)
    if spec.law == "output feedback":
        measured = None if spec.measured is None else tuple(spec.measured)
        return OutputFeedbackDesign(
            channels, spec.degree, spec.decay_rate, spec.fastest_pole, spec.feedthrough, measured,
            backoff=spec.backoff, settings=settings, regions=regions_of(spec),
        )  # fmt: skip
    if spec.law == "static output feedback":
        start = None if spec.start is None else tuple(tuple(row) for row in spec.start)
        uses = None if spec.uses is None else tuple((pair[0], pair[1]) for pair in spec.uses)
        return StaticFeedbackDesign(
            channels, spec.degree, spec.decay_rate, spec.fastest_pole, start, uses,
            backoff=spec.backoff, settings=settings,
        )  # fmt: skip
    limits = None if spec.input_limits is None else GainLimits(spec.input_limits, spec.state_sizes or {})
    return StateFeedbackDesign(
        channels, spec.degree, spec.decay_rate, spec.fastest_pole, spec.damping, limits, spec.backoff, settings=settings,
        regions=regions_of(spec),
    )  # fmt: skip


def design_feedback(
    model: LpvModel, design: FeedbackDesign, law: str, sample_time: float, weights: int = 0
) -> FeedbackLaw:
    """The law of a design; of both laws of the states, the sampled one is designed for the sample time.

    `weights` is the number of states of dynamic weights, the last ones of the model.
    """
    if isinstance(design, OutputFeedbackDesign):
        return design_output_feedback(model, design)
    if isinstance(design, StaticFeedbackDesign):
        return design_static_feedback(model, design)
    period = sample_time if law == SAMPLED else None
    if weights:
        return design_weighted_state_feedback(model, design, weights, period)
    if period is not None:
        return design_sampled_state_feedback(model, design, period)
    return design_state_feedback(model, design)


def form_of(model: LpvModel, design: FeedbackDesign, weights: int = 0) -> tuple[Measured, int]:
    """What the law measures, and its order; `weights` as for `design_feedback`."""
    if isinstance(design, StateFeedbackDesign) and weights:
        return "outputs", weights
    if isinstance(design, StateFeedbackDesign):
        return "states", 0
    return "outputs", len(model.states) if isinstance(design, OutputFeedbackDesign) else 0


def without_other_laws(resolved: dict[str, Any]) -> dict[str, Any]:
    """A dumped specification without the keys that its law does not have: digests of observers stay what they were."""
    design, deploy = dict(resolved["design"]), dict(resolved["deploy"])
    for key in ("regions", "dynamic_weights"):
        if design[key] is None:
            design.pop(key)
    if "regions" in design:  # the key is younger than the digests
        design["regions"] = {k: v for k, v in design["regions"].items() if v is not None or k != "sampled_disc"}
    if "dynamic_weights" in design:
        design["dynamic_weights"] = [{k: v for k, v in w.items() if v is not None} for w in design["dynamic_weights"]]
    if design["law"] is None:
        design = {key: value for key, value in design.items() if key not in ("law", *OF_LAWS)}
        deploy.pop("limits")
    else:
        own = KEYS_OF[design["law"]]
        design = {k: v for k, v in design.items() if k in own or k not in OF_LAWS}
        deploy.pop("update")
    dropped = [{k: v for k, v in c.items() if v is not None or k not in OF_CHANNELS} for c in design["channels"]]
    return {**resolved, "design": {**design, "channels": dropped}, "deploy": deploy}


def regions_of(spec: DesignSpec) -> PoleRegions:
    """As the synthesis takes them."""
    if spec.regions is None:
        return PoleRegions()
    given = spec.regions
    strip, disc = (None if x is None else (x[0], x[1]) for x in (given.vertical_strip, given.sampled_disc))
    return PoleRegions(given.disc, given.damping, strip, given.horizontal_strip, disc)


def _numbers(values: list[float] | None) -> tuple[float, ...] | None:
    return None if values is None else tuple(values)
