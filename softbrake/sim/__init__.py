"""One drop: its arrays, its course, its result file, its answer."""
