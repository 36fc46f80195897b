"""Proposals for a recipe from motion files: unit, axes, feet and heading, with evidence."""
