"""Conversion of a log's units, frames and clocks to SI, north-east-down and one clock."""
