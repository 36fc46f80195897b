"""Static documents: the contract and the HTML pages."""
