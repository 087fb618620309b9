"""The version, which stands here alone; pyproject.toml and the citation follow it."""

__version__ = "0.2.0"
