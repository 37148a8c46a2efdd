"""Are missing effects named? Cases with a known hidden truth, what is right in them, and simple rivals."""
