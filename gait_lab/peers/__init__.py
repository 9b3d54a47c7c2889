"""Walks of other packages, played on our plant."""
