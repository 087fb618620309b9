"""Geometry of a triangle mesh: topology, measures, finite elements, curvature."""
