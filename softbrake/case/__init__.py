"""Case file to frozen dataclasses, with every message about input."""
