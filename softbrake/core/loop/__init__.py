"""A step of each fidelity, and the loop over steps. Start reading at `step.take_step`."""
