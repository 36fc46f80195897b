"""Universal kriging of the coefficients and of timing."""
