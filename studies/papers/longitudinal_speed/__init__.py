"""P2, longitudinal speed estimation robust to road conditions: claims, tables and figures."""
