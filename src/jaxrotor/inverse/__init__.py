"""From measurements or wishes back to parameters: identification."""
