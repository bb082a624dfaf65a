"""Many drops: sweep, inverse design, sensitivity, error control, work-precision, stability."""
