"""Tests of the innovations of a model."""
