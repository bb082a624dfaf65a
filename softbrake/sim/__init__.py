"""One drop: its arrays, its steps, its result file, its answer."""
