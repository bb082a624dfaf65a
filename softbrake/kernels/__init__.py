"""Compiled kernels on plain arrays; they know nothing of case files, results or the command line."""
