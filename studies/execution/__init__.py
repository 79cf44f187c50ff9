"""What every run needs: whole files, a lock, worker processes or a cluster, and fingerprints of what is computed."""
