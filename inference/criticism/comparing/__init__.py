"""What comparing is made of: where a misfit sits, whether it is one at all, and point sets as distributions."""
