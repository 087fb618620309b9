"""Cleaning: from the faces of any file to a surface that is fit for finite elements."""
