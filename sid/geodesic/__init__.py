"""Geodesic distances, exact or by fast marching, up to a radius. Imports nothing else of sid."""
