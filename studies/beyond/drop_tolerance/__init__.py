"""How many lost force measurements the velocity observers survive: predicted, and seen on the runtime observer itself."""
