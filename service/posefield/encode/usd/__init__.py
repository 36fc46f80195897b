"""USD clips: layers written from cached templates."""
