"""The physical effects that muslin ships."""
