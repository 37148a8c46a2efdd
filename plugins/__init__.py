"""Built-in physical effects and separate plugin distributions."""
