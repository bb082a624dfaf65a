"""Tensions of fabric and belts, and the forces they put on the nodes."""
