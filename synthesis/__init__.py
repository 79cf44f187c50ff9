"""Symbolic LPV models, LMI engine, observer design, certificates and export."""
