"""Models opened from files, and their answers: poses, clips, crowds, sigma and suggestions."""
