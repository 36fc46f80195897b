"""Tables of answers, for copies of the page that run without a service."""
