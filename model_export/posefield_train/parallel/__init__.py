"""Jobs in processes or on a cluster."""
