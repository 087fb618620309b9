"""The eigensolver: the smallest eigenpairs of a pencil, certified. Imports of sid only `compilation`."""
