"""Arrays and kernels.

Kernels of a row take its arrays and their offsets one by one, up to fourteen: a row is a part of several arrays, tests call them
over whole grids, and a tuple made for each row costs its copy.
"""
