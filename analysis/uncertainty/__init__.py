"""Real parameters that are not known: how far they may go before a system is unstable, and its worst gain."""
