"""The battery of an axis: its test with conditions, course and verdict, and the change of a battery."""
