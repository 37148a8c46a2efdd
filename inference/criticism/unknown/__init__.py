"""The unknown: which force is missing where no named effect explains a misfit, and what law it follows."""
