"""The report of the studies as one page, and the scoreboard."""
