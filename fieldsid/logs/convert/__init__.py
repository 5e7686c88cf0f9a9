"""From a log's own units, frames and clocks to SI, north-east-down and one clock."""
