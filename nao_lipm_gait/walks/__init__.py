"""The walk engines, and what they share."""
