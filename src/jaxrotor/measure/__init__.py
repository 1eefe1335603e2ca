"""What is measured on a run: energies, spectra."""
