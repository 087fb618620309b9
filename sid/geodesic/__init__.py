"""Geodesic distances, exact or by fast marching, up to a radius. Imports of sid only `compilation`."""
