"""The eigensolver: the smallest eigenpairs of stiffness and mass, certified. Imports nothing else of sid."""
