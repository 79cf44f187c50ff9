"""How much of the slip velocity a corner observer must miss as friction saturates, and what the fusion recovers."""
