"""Figures: curves of tables, and renderings of surfaces."""
