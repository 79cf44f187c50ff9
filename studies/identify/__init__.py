"""Tire parameters of the corner models, effective radius and wheel inertia from a recorded drive."""
