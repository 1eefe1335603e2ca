"""From a machine to its motion: steps, solvers, starts and results."""
