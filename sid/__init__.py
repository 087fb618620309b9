"""Points of interest on 3D meshes by spectral irregularity diffusion."""
