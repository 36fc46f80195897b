"""HTTP: the contract, its operations and the process that serves them."""
