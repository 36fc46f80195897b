"""Results as tables: JSON, MessagePack, npz and Arrow."""
