"""What crossed the buses, for people who look at frames."""
