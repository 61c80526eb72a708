"""The part that stands for the factor and the offset of a wire in exported systems."""
