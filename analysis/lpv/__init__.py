"""Linear parameter-varying systems as they are given: levels that are proved, and trajectories that show how near they are."""
