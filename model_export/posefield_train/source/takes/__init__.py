"""Takes: clips that were recorded in one go, so that they are left out together."""
