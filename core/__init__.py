"""Interfaces, domain types, the store, the registry and the study. Needs no engine and no torch."""
