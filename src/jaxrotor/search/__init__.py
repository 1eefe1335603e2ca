"""Unknown parameters by name, for identification and optimisation."""
