"""What every room uses: parameters, units, the protocol of elements, errors, files."""
