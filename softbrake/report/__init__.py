"""Answers as text, pages and pictures."""
