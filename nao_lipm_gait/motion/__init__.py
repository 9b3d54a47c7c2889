"""Motions made of keyframes: files, checks, and playing them."""
