"""What a run costs: `python -m benchmarks`. Nothing here asserts a time; ratios to a calibration loop compare machines."""
