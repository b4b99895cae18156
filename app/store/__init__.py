"""What is kept: parameter sets, motors, incidents, users, audit."""
