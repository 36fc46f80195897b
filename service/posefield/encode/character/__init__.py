"""Characters at rest and in motion: body mesh, joint names, samples and extents."""
