"""Whether posteriors keep their promises: ranks, coverage, and predictions held against the measurement."""
