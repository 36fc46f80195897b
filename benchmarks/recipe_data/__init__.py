"""Conversion of motion data as their owners publish it to what the shipped recipes read."""
