"""What the jobs of a workflow share: one line on failure, progress, and the account at the end of a run."""
