"""Residuals of the laws of mechanics, contact and friction along a run: what it shows is enough, no second run."""
