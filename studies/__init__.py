"""Everything that talks or draws: command line, specifications, drives, reports."""
