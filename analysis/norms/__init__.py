"""H-infinity and H2 norms of stacks of systems, and the floor that no gain can lower."""
