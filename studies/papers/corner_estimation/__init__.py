"""P1, corner-based estimation of tire forces and vehicle velocities: claims, tables and figures."""
