"""Lost measurements: critical drop probabilities of frozen loops, of schedules, and with bursts."""
