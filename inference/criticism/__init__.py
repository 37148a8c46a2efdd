"""Compare, diagnose."""
