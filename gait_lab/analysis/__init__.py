"""Traces, metrics, bags and figures."""
