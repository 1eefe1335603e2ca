"""Controllers, actuators, and what they measure."""
