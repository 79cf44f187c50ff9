"""A plant, a law and how they are connected: the closed loop that is searched, proved and run."""
