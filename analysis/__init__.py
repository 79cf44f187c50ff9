"""Norms, sensitivity, switching, Markov jumps, packet drops, observability: a toolbox that works on any model.

Import from the modules; each is one idea:

- `norms`, `norms_h2`, `error_norms`, `dc_floor`: H-infinity and H2 norms of stacks of systems, the floor no gain can lower
- `sensitivity` (designs, one at a time, Sobol indices, quantiles, worst case), `perturbed`, `labelled`
- `switching_similarity`, `switching_lyapunov`, `switching_pair`, `joint_spectral_radius`
- `markov`, `markov_chain`, `markov_continuous`, `markov_montecarlo`, `coupled_lyapunov`, `coupled_lmi`, `coupled_riccati`
- `dropout`, `dropout_modes`, `dropout_schedule`, `mean_square_schedule`, `gilbert_elliott`, `intermittent`
- `observability`, `rank_loss`, `observability_modes`, `observability_windows`, `gramians`, `lie_rank`, `lie_structure`
- `stochastic_observability`, `bounds`, `bounds_sliding_mode`, `loads`
"""
