"""Rendered walks over the pitch, and percepts judged by the truth."""
