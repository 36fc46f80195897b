"""USD clips: characters, animations, performances and libraries."""
