"""Motion files of any format after reading: one type, and its conversion to a clip."""
