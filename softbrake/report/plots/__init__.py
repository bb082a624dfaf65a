"""Pictures, all by matplotlib."""
