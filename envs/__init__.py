"""Gymnasium environments over the plant."""
