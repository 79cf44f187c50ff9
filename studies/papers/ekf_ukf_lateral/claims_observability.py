"""P4-obs: is the eight-state model observable wherever the car moves and steers?"""

from __future__ import annotations

from studies.claim import Finding, judged
from studies.papers.ekf_ukf_lateral.observability import (
    corrected_model,
    printed_output_model,
    rank_of,
    rank_through_straight,
    rear_split_is_hidden,
    singular_at_standstill,
)
from synthesis.models.nonlinear import NonlinearModel


def observability(model: NonlinearModel | None = None) -> Finding:
    """Rank while steering and at zero steering, of (11)-(12) with corrected y_4 (or of `model`), beside the printed y_4."""
    chosen = model or corrected_model()
    steering, straight = rank_of(chosen, False), rank_of(chosen, True)
    printed = rank_of(printed_output_model(), False), rank_of(printed_output_model(), True)
    hidden = rear_split_is_hidden(chosen)
    upper = 7 if hidden else 8
    computed = {
        "rank": steering.rank,
        "rank_upper_bound": upper,
        "rank_at_zero_steering": straight.rank,
        "rank_steering_through_zero": rank_through_straight(),
        "hidden_directions": list(steering.structure.describe()),
        "hidden_directions_at_zero_steering": list(straight.structure.describe()),
        "singular_at_zero_speed": singular_at_standstill(),
        "rank_with_y4_as_printed": printed[0].rank,
        "rank_with_y4_as_printed_at_zero_steering": printed[1].rank,
    }
    reading = (
        f"The rank is {steering.rank} at almost every state and {straight.rank} while driving straight ahead. The "
        "difference of the rear lateral forces enters no output and no other state: two motions that differ in it "
        "alone measure the same for ever (an exact identity). It decays with V / sigma_2, so the model is "
        "detectable. Rank 8 with the exception at zero steering holds for the printed y_4, whose x_6 sin(u_1) is a "
        f"misprint (rank {printed[0].rank} and {printed[1].rank})."
        if hidden
        else f"The rank is {steering.rank} at almost every state and {straight.rank} while driving straight ahead."
    )
    return Finding(computed, judged(min(steering.rank, upper) == 8 and straight.rank < 8), reading)


CLAIMS = {"P4-obs": observability}
